"""A lot of units: how they differ, how many are good, which are odd, what has shifted.

Of each unit the last good session counts. The yield k of n has the interval of
Jeffreys,

    Beta(k + 1/2, n - k + 1/2)                                                      (1)

Source: Brown, Cai and DasGupta, Statistical Science 16 (2001) 101.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import beta

from fieldcal.calibration.limits import GradeLimits
from fieldcal.core.errors import InputError
from fieldcal.fleet.capability import LotParameter, capability
from fieldcal.fleet.levels import Grouping, groupings
from fieldcal.fleet.odd import discovered, unit_chances
from fieldcal.fleet.shifts import Shift, shifts
from fieldcal.history.sessions import LEVELS, StoredSession, values

FEWEST = 5
"""Units from which a parameter has a spread."""


@dataclass(frozen=True, slots=True)
class OddUnit:
    """A unit out of family: by which parameter, and how far."""

    serial: str
    folder: str
    parameter: str
    off: float
    sigma: float
    chance: float


@dataclass(frozen=True, slots=True)
class Alarm:
    """A control chart that left its limits, at which unit, and since which."""

    parameter: str
    chart: str
    at: str
    since: str | None


@dataclass(frozen=True, slots=True)
class Lot:
    """What is said of a lot.

    Attributes
    ----------
    sessions, failed : how many, and how many of them have no result
    units : the session that counts of each, in the order of time
    good, judged : units that are, by GO where that was judged; and all that count
    share : good of judged, with the ends of its 95 % interval (1)
    parameters : by name
    odd : units at the false-discovery rate
    rate : that rate
    shifts : by level
    alarms : of control charts

    """

    sessions: int
    failed: int
    units: tuple[StoredSession, ...]
    good: int
    judged: int
    share: tuple[float, float, float]
    parameters: Mapping[str, LotParameter]
    odd: tuple[OddUnit, ...]
    rate: float
    shifts: tuple[Shift, ...]
    alarms: tuple[Alarm, ...]

    @property
    def in_control(self) -> bool:
        """Whether nothing is odd, shifted or beyond its limits."""
        return not (self.odd or self.shifts or self.alarms)

    def to_json(self) -> dict[str, Any]:
        """Return it as an object."""
        share, low, high = self.share
        return {
            "sessions": self.sessions,
            "without_result": self.failed,
            "units": len(self.units),
            "yield": {
                "good": self.good,
                "of": self.judged,
                "share": share,
                "share_95": [low, high],
            },
            "parameters": {n: p.to_json() for n, p in self.parameters.items()},
            "false_discovery_rate": self.rate,
            "odd": [
                {
                    "serial": o.serial,
                    "session": o.folder,
                    "parameter": o.parameter,
                    "off": o.off,
                    "sigma": o.sigma,
                    "chance": o.chance,
                }
                for o in self.odd
            ],
            "shifts": [
                {
                    "parameter": s.parameter,
                    "level": s.level,
                    "probability": s.probability,
                    "groups": {
                        label: {"value": v, "sigma": e}
                        for label, v, e in zip(
                            s.labels, s.values.tolist(), s.sigmas.tolist(), strict=True
                        )
                    },
                }
                for s in self.shifts
            ],
            "alarms": [
                {"parameter": a.parameter, "chart": a.chart, "at": a.at,
                 "since": a.since}
                for a in self.alarms
            ],
        }  # fmt: skip


def lot(
    sessions: Sequence[StoredSession], limits: GradeLimits, rate: float = 0.05
) -> Lot:
    """What sessions of a lot say together.

    Parameters
    ----------
    sessions : from the store
    limits : of the grade, for the tolerances
    rate : of false discoveries among odd units

    Raises
    ------
    InputError
        If fewer than `FEWEST` units have a result.

    """
    units = last_of_units(sessions)
    useful = [one for one in units if one.good]
    if len(useful) < FEWEST:
        raise InputError(
            f"units with a good result: {len(useful)}, a lot needs {FEWEST}: run"
            " fieldcal batch on more sessions, or ask for fewer conditions"
        )
    names = dict.fromkeys(n for one in useful for n in one.parameters)
    found = {}
    for name in names:
        x, sigma = values(useful, name)
        known = np.isfinite(x) & (sigma > 0)
        if known.sum() >= FEWEST:
            found[name] = (np.flatnonzero(known), x[known], sigma[known])
    parameters = {
        name: capability(
            name, useful[told[0][0]].parameters[name][2], *told, limits, len(found)
        )
        for name, told in found.items()
    }
    levels = [
        g
        for g in groupings([one.levels for one in useful], LEVELS)
        if 1 < len(g.labels) < len(useful)
    ]
    judged = [one.go if one.go is not None else bool(one.good) for one in units]
    return Lot(
        len(sessions),
        sum(one.error is not None for one in sessions),
        tuple(useful),
        sum(judged),
        len(judged),
        share(sum(judged), len(judged)),
        parameters,
        tuple(_odd(useful, parameters, rate)),
        rate,
        tuple(s for p in parameters.values() for s in _shifts(p, levels)),
        tuple(a for p in parameters.values() for a in _alarms(p, useful)),
    )


def last_of_units(sessions: Sequence[StoredSession]) -> list[StoredSession]:
    """The last session of each unit that has a good result, else its last one."""
    units: dict[str, StoredSession] = {}
    for one in sorted(sessions, key=_when):
        key = one.serial or one.folder
        before = units.pop(key, None)
        kept = before is not None and before.good and not one.good
        units[key] = before if before is not None and kept else one
    return sorted(units.values(), key=_when)


def share(good: int, count: int) -> tuple[float, float, float]:
    """Share with its 95 % interval, (1).

    >>> [round(x, 3) for x in share(9, 10)]
    [0.9, 0.619, 0.989]
    """
    a, b = good + 0.5, count - good + 0.5
    low = 0.0 if not good else float(beta.ppf(0.025, a, b))
    high = 1.0 if good == count else float(beta.ppf(0.975, a, b))
    return good / count, low, high


def _when(one: StoredSession) -> tuple[str, str]:
    return (one.taken_at or "", one.folder)


def _odd(
    useful: Sequence[StoredSession], parameters: Mapping[str, LotParameter], rate: float
) -> list[OddUnit]:
    names = list(parameters)
    chances = np.full((len(useful), len(names)), np.nan)
    off, sigma = chances.copy(), chances.copy()
    for k, one in enumerate(parameters.values()):
        chances[one.units, k] = one.about.chances(one.x)
        off[one.units, k], sigma[one.units, k] = one.x - one.about.mean, one.about.sigma
    together = unit_chances(chances)
    out = []
    for i in np.flatnonzero(discovered(together, rate)).tolist():
        k = int(np.nanargmin(chances[i]))
        unit = useful[i]
        out.append(
            OddUnit(
                unit.serial, unit.folder, names[k], float(off[i, k]),
                float(sigma[i, k]), float(together[i]),
            )
        )  # fmt: skip
    return sorted(out, key=lambda one: one.chance)


def _shifts(one: LotParameter, levels: Sequence[Grouping]) -> list[Shift]:
    some = []
    for level in levels:
        labels = [level.labels[i] for i in level.index[one.units]]
        made = Grouping.of(" or ".join(level.names), labels)
        if len(made.labels) > 1:
            some.append(made)
    return shifts(one.name, one.x, one.sigma, one.about, some)


def _alarms(one: LotParameter, useful: Sequence[StoredSession]) -> list[Alarm]:
    def named(number: int) -> str:
        unit = useful[int(one.units[number])]
        return unit.serial or unit.folder

    return [
        Alarm(
            one.name,
            chart.name,
            named(chart.alarm),
            None if chart.onset is None else named(chart.onset),
        )
        for chart in one.charts
        if chart.alarm is not None
    ]
