"""One comparison of a calibration with a limit, in a sentence with its numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

MENDABLE_CHECKS = ("fit", "positions", "witnesses", "turns", "level")
"""Checks, beside those of uncertainties, that further positions may change. Checks of
site, temperature, link, insisted positions and earlier calibrations are unaffected."""


@dataclass(frozen=True, slots=True)
class Check:
    """One comparison with a limit.

    Attributes
    ----------
    name : name of the check
    ok : whether the value is within the limit; None if it could not be checked
    says : sentence with the result
    value, limit : compared numbers; None if there are none
    unit : unit of both

    """

    name: str
    ok: bool | None
    says: str
    value: float | None = None
    limit: float | None = None
    unit: str = ""

    def to_json(self) -> dict[str, Any]:
        """Return the object of result.json."""
        out: dict[str, Any] = {"name": self.name, "ok": self.ok, "says": self.says}
        if self.value is not None:
            out |= {"value": self.value, "limit": self.limit, "unit": self.unit}
        return out


def unit_suffix(unit: str) -> str:
    """Unit to be written after a number, with a space; empty for a plain number."""
    return "" if unit == "1" else f" {unit.replace('^2', '²')}"
