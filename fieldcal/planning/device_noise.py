"""The noise of one device, as it was measured, in the place of its grade's.

A window of T has the error s(T) of the worst axis of each triad, measured at several T;
in the planner's terms it is N and what stands beside it,

    B^2 = s(T)^2 - N^2 / T                                                         (1)

so that a device whose bias walks gets no better by longer windows. Units: m/s^2, rad/s.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.planning.planner import Grade


@dataclass(frozen=True, slots=True)
class TriadNoise:
    """The worst axis of a triad.

    Attributes
    ----------
    unit : of its outputs
    white : N, per sqrt(Hz)
    seconds, sigma : (t,) lengths of windows, s, and their errors
    best_s : time after which its mean gets no better; None where longer than is known

    """

    unit: str
    white: float
    seconds: Array
    sigma: Array
    best_s: float | None

    def error(self, seconds: float) -> float:
        """Error of a mean over `seconds`; white noise below what was measured."""
        if seconds < self.seconds[0]:
            return float(self.sigma[0] * np.sqrt(self.seconds[0] / seconds))
        at = np.log(seconds), np.log(self.seconds), np.log(self.sigma)
        return float(np.exp(np.interp(*at)))


@dataclass(frozen=True, slots=True)
class DeviceNoise:
    """Both triads; None where one was not measured."""

    acc: TriadNoise | None
    gyr: TriadNoise | None

    def grade(self, seconds: float) -> Grade:
        """What the planner asks of a grade, for windows of `seconds`, (1)."""
        parts: list[float] = []
        for triad in (self.acc, self.gyr):
            if triad is None:
                parts += [0.0, np.inf]
                continue
            rest = triad.error(seconds) ** 2 - triad.white**2 / seconds
            parts += [triad.white, float(np.sqrt(max(rest, 0.0)))]
        return Grade(*parts)

    def sentence(self, seconds: float) -> str:
        """How long this device is worth averaging."""
        said = []
        for name, triad in (("accelerometers", self.acc), ("gyroscopes", self.gyr)):
            if triad is not None:
                error = f"{triad.error(seconds):.2g} {triad.unit.replace('^2', '²')}"
                best = "longer than its recording tells"
                if triad.best_s is not None:
                    best = f"{triad.best_s:.0f} s"
                said.append(
                    f"{name}: a mean of {seconds:g} s is ± {error}, best after {best}"
                )
        return "; ".join(said)

    def to_json(self) -> dict[str, Any]:
        """The best averaging times, s."""
        return {
            name: triad and triad.best_s
            for name, triad in (("acc_best_s", self.acc), ("gyr_best_s", self.gyr))
        }


def of_document(content: Mapping[str, Any]) -> DeviceNoise:
    """From a checked noise.json."""
    return DeviceNoise(_worst(content, "a"), _worst(content, "g"))


def _worst(content: Mapping[str, Any], triad: str) -> TriadNoise | None:
    some = [
        c
        for n, c in content["channels"].items()
        if n[0] == triad and c["averaging"]["seconds"]
    ]
    if not some:
        return None
    count = min(len(c["averaging"]["seconds"]) for c in some)
    best = [c["averaging"]["best_s"] for c in some]
    known = [b for b in best if b is not None]
    return TriadNoise(
        some[0]["unit"],
        max(c["processes"]["N"]["value"] for c in some),
        np.array(some[0]["averaging"]["seconds"][:count], dtype=float),
        np.max([c["averaging"]["sigma"][:count] for c in some], axis=0),
        min(known) if known else None,
    )
