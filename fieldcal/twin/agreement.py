"""How far replays of a session are from the recording, in figures and in sentences."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.diagnosis.findings.agreement import UNITS
from fieldcal.diagnosis.result import json_number
from fieldcal.sim_device.profile import Profile
from fieldcal.twin.ways import TurnDifference


@dataclass(frozen=True, slots=True)
class ReplayFigures:
    """Differences between one device's replay and the recording.

    Attributes
    ----------
    rms : (2,) m/s^2 and rad/s, over parts of all windows
    chi2_per_dof : of all windows
    by_position : (p, 2) rms in each window
    chi2_by_position : (p,) chi squared per mean of each window, with its white noise
    lines : (k, 2) rms of the remainder of each line, m/s^2 and rad/s
    ways : differences in turns; nan where no turn could be followed

    """

    rms: Array
    chi2_per_dof: float
    by_position: Array
    chi2_by_position: Array
    lines: Array
    ways: TurnDifference

    def to_json(self) -> dict[str, Any]:
        """Return the object of diagnosis.json."""
        return {
            **_pair(self.rms),
            "chi2_per_dof": json_number(self.chi2_per_dof),
            "lines": [_pair(line) for line in self.lines],
            "rms_turns_rad": json_number(self.ways.angle),
            "rms_turns_acceleration": json_number(self.ways.force),
        }


@dataclass(frozen=True, slots=True)
class ReplayResult:
    """A session replayed.

    Attributes
    ----------
    profile : the twin
    runs : figures of the devices "simulation" (of session.toml), "refitted" and "twin"
    positions : numbers of the compared positions in session.toml
    windows : (p, 2) from and to, s
    random : random effects, which the replay leaves out
    triad : with the largest improvement: 0 accelerometers, 1 gyroscopes
    found : names of the causes found

    """

    profile: Profile
    runs: Mapping[str, ReplayFigures]
    positions: tuple[int, ...]
    windows: Array
    random: tuple[str, ...]
    triad: int
    found: tuple[str, ...]

    def to_json(self, name: str) -> dict[str, Any]:
        """Return the object of diagnosis.json; `name` is the device file's."""
        places = [
            {
                "position": p,
                "from_s": json_number(w[0]),
                "to_s": json_number(w[1]),
                **{
                    n: {
                        **_pair(run.by_position[i]),
                        "chi2_per_mean": json_number(run.chi2_by_position[i]),
                    }
                    for n, run in self.runs.items()
                },
            }
            for i, (p, w) in enumerate(zip(self.positions, self.windows, strict=True))
        ]
        return {
            "device": name,
            **{n: run.to_json() for n, run in self.runs.items()},
            "positions": places,
            "random": list(self.random),
        }

    @property
    def says(self) -> str:
        """The result in a few sentences."""
        old, new = self.runs["refitted"], self.runs["twin"]
        unit = UNITS[self.triad]
        out = [
            "Replayed by the virtual device with its own physics, the twin is"
            f" {new.rms[self.triad]:.2g} {unit} rms from the recording (χ²"
            f" {new.chi2_per_dof:.3g} a degree of freedom); without what is left out"
            f" it is {old.rms[self.triad]:.2g} {unit} (χ² {old.chi2_per_dof:.3g})."
        ]
        for before, after in zip(old.lines, new.lines, strict=True):
            less = before / np.where(after > 0, after, np.nan)
            i = int(np.argmax(np.nan_to_num(less, nan=-1.0)))
            out.append(
                f"Of the line it leaves {after[i]:.2g} of {before[i]:.2g} {UNITS[i]}."
            )
        if np.isfinite(new.ways.angle):
            out += self._on_ways(old.ways, new.ways)
        if self.random:
            out.append(
                f"{' and '.join(self.random)} is drawn anew in every run of the twin:"
                " compare its spread, not its numbers."
            )
        return " ".join(out)

    def _on_ways(self, old: TurnDifference, new: TurnDifference) -> Iterator[str]:
        if {"gyro_scale", "gyro_cross_coupling"} & {*self.found}:
            yield (
                f"Turns come out {new.angle:.2g} rad off instead of"
                f" {old.angle:.2g} rad."
            )
        if {"lever_arm", "time_delay"} & {*self.found}:
            yield (
                f"On the way the accelerometers are {new.force:.2g} m/s^2 rms from the"
                f" recording instead of {old.force:.2g} m/s^2."
            )


def _pair(values: Array) -> dict[str, float | None]:
    return {
        "rms_acceleration": json_number(float(values[0])),
        "rms_angular_rate": json_number(float(values[1])),
    }
