"""Measured noise of one device, for use in place of the noise of its grade.

A window of T has the error s(T) of the worst axis of each triad, measured at several T;
in the planner's terms it is N and the floor B,

    B^2 = s(T)^2 - N^2 / T                                                         (1)

so that longer windows do not help a device with a random walk of its bias. Units:
m/s^2, rad/s.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.planning.planner import GradeNoise


@dataclass(frozen=True, slots=True)
class TriadNoise:
    """Noise of the worst axis of a triad.

    Attributes
    ----------
    unit : unit of the outputs
    white : N, per sqrt(Hz)
    seconds, sigma : (t,) lengths of windows, s, and their errors
    best_s : time after which the mean does not improve, s; None if beyond the recording

    """

    unit: str
    white: float
    seconds: Array
    sigma: Array
    best_s: float | None

    def error(self, seconds: float) -> float:
        """Error of a mean over `seconds`; white noise below the measured times."""
        if seconds < self.seconds[0]:
            return float(self.sigma[0] * np.sqrt(self.seconds[0] / seconds))
        at = np.log(seconds), np.log(self.seconds), np.log(self.sigma)
        return float(np.exp(np.interp(*at)))


@dataclass(frozen=True, slots=True)
class DeviceNoise:
    """Noise of both triads; None for one that was not measured."""

    acc: TriadNoise | None
    gyr: TriadNoise | None

    def grade(self, seconds: float) -> GradeNoise:
        """The noise in the terms of the planner, for windows of `seconds`, (1).

        The white noise of a triad that was not measured is nan: 0 would be a triad
        without any.
        """
        parts: list[float] = []
        for triad in (self.acc, self.gyr):
            if triad is None:
                parts += [np.nan, np.inf]
                continue
            rest = triad.error(seconds) ** 2 - triad.white**2 / seconds
            parts += [triad.white, float(np.sqrt(max(rest, 0.0)))]
        return GradeNoise(*parts)

    def sentence(self, seconds: float) -> str:
        """Sentence with the errors of means and the best averaging times."""
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


def device_noise_from(content: Mapping[str, Any]) -> DeviceNoise:
    """Read the content of a checked noise.json."""
    return DeviceNoise(_worst_axis(content, "a"), _worst_axis(content, "g"))


def _worst_axis(content: Mapping[str, Any], triad: str) -> TriadNoise | None:
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
