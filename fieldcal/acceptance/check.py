"""One comparison of a calibration with a limit, in a sentence with its numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Check:
    """One comparison with a limit.

    Attributes
    ----------
    name : of what was checked
    ok : whether it is within the limit; None where it could not be checked
    says : one sentence
    value, limit : None where there is no number
    unit : of both

    """

    name: str
    ok: bool | None
    says: str
    value: float | None = None
    limit: float | None = None
    unit: str = ""

    def to_json(self) -> dict[str, Any]:
        """As it stands in the document."""
        out: dict[str, Any] = {"name": self.name, "ok": self.ok, "says": self.says}
        if self.value is not None:
            out |= {"value": self.value, "limit": self.limit, "unit": self.unit}
        return out


def shown_unit(unit: str) -> str:
    """What stands behind a number; nothing behind one without a unit."""
    return "" if unit == "1" else f" {unit.replace('^2', '²')}"
