"""Analysis of a lot: yield, spread of the units, odd units, shifts and control charts.

Each unit is represented by its last good session.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fieldcal.calibration.limits import GradeLimits
from fieldcal.calibration.names import TILTS, group_of
from fieldcal.core.errors import InputError
from fieldcal.fleet.capability import LotParameter, lot_parameter
from fieldcal.fleet.levels import Grouping, groupings
from fieldcal.fleet.lot_yield import yield_interval
from fieldcal.fleet.odd import benjamini_hochberg, unit_p_values
from fieldcal.fleet.shifts import Shift, find_shifts
from fieldcal.fleet.units import is_unit, latest_session_per_unit, serials_alike
from fieldcal.history.filters import LEVELS
from fieldcal.history.sessions import StoredSession, parameter_values

MIN_UNITS = 5
"""Smallest number of units for which a spread is estimated."""


NOT_STATED = "not stated"
"""Label of the units whose session.toml does not state a level that others state."""


@dataclass(frozen=True, slots=True)
class OddUnit:
    """A unit that is odd: the parameter and its deviation from the mean of the lot."""

    serial: str
    folder: str
    parameter: str
    deviation: float
    sigma: float
    probability: float


@dataclass(frozen=True, slots=True)
class Alarm:
    """A control chart beyond its limits, and the first unit after the mean's change."""

    parameter: str
    chart: str
    at: str
    since: str


@dataclass(frozen=True, slots=True)
class LotAnalysis:
    """Result of the analysis of a lot.

    Attributes
    ----------
    sessions, failed : number of sessions, and of those without a result
    units : session that represents each unit, in the order of time
    good, judged : number of good units (GO, if that was judged), and of all units
    unmeasured : units of `judged` that have sessions but no result
    yield_share : good / judged, with the ends of its 95 % interval
    parameters : parameters by name
    odd : odd units at the false-discovery rate
    false_discovery_rate : accepted rate of false discoveries among odd units
    shifts : levels that shift a parameter
    alarms : alarms of control charts

    """

    sessions: int
    failed: int
    units: tuple[StoredSession, ...]
    good: int
    judged: int
    unmeasured: int
    yield_share: tuple[float, float, float]
    parameters: Mapping[str, LotParameter]
    odd: tuple[OddUnit, ...]
    false_discovery_rate: float
    shifts: tuple[Shift, ...]
    alarms: tuple[Alarm, ...]

    @property
    def in_control(self) -> bool:
        """Whether there is no odd unit, no shift and no alarm."""
        return not (self.odd or self.shifts or self.alarms)

    @property
    def untimed(self) -> int:
        """Number of units whose time is unknown; control charts exclude them."""
        return sum(one.taken_at is None for one in self.units)

    def to_json(self) -> dict[str, Any]:
        """Return it as an object."""
        share, low, high = self.yield_share
        return {
            "sessions": self.sessions,
            "without_result": self.failed,
            "units": len(self.units),
            "units_of_unknown_time": self.untimed,
            "yield": {
                "good": self.good,
                "of": self.judged,
                "of_them_without_result": self.unmeasured,
                "share": share,
                "share_95": [low, high],
            },
            "parameters": {n: p.to_json() for n, p in self.parameters.items()},
            "false_discovery_rate": self.false_discovery_rate,
            "odd": [
                {
                    "serial": o.serial,
                    "session": o.folder,
                    "parameter": o.parameter,
                    "off": o.deviation,
                    "sigma": o.sigma,
                    "chance": o.probability,
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


def analyse_lot(
    sessions: Sequence[StoredSession], limits: GradeLimits, rate: float = 0.05
) -> LotAnalysis:
    """Analyse the sessions of a lot: yield, spread, odd units, shifts and charts.

    Parameters
    ----------
    sessions : sessions from the store
    limits : limits of the grade, which contain the tolerances
    rate : false-discovery rate of odd units

    Raises
    ------
    InputError
        If fewer than `MIN_UNITS` units have a result.

    """
    units = [one for one in latest_session_per_unit(sessions) if is_unit(one)]
    useful = [one for one in units if one.good]
    if len(useful) < MIN_UNITS:
        raise InputError(
            f"units with a good result: {len(useful)}, a lot needs {MIN_UNITS}: run"
            " fieldcal batch on more sessions, or ask for fewer conditions"
        )
    parameters = _lot_parameters(useful, limits)
    levels = [
        g
        for g in groupings(_stated_levels(useful), LEVELS)
        if 1 < len(g.labels) < len(useful)
    ]
    judged = [one.go if one.go is not None else bool(one.good) for one in units]
    return LotAnalysis(
        len(sessions),
        sum(one.good is None for one in sessions),
        tuple(useful),
        sum(judged),
        len(judged),
        sum(one.good is None for one in units),
        yield_interval(sum(judged), len(judged)),
        parameters,
        tuple(_find_odd_units(useful, parameters, rate)),
        rate,
        tuple(s for p in parameters.values() for s in _find_shifts(p, levels)),
        tuple(a for p in parameters.values() for a in _find_alarms(p, useful)),
    )


def _lot_parameters(
    useful: Sequence[StoredSession], limits: GradeLimits
) -> dict[str, LotParameter]:
    """Each parameter that enough units have."""
    names = dict.fromkeys(n for one in useful for n in one.parameters)
    found = {}
    for name in names:
        x, sigma = parameter_values(useful, name)
        known = np.isfinite(x) & (sigma > 0)
        if known.sum() >= MIN_UNITS:
            found[name] = (np.flatnonzero(known), x[known], sigma[known])
    return {
        name: lot_parameter(
            name,
            useful[told[0][0]].parameters[name][2],
            *told,
            limits,
            len(found),
            sum(useful[i].taken_at is None for i in told[0].tolist()),
        )
        for name, told in found.items()
    }


def serials_sentence(found: LotAnalysis) -> str:
    """Sentence about serial numbers that may be of one unit; empty without any."""
    alike = serials_alike(found.units)
    if not alike:
        return ""
    named = "; ".join(" and ".join(some) for some in alike)
    return (
        f"serial numbers that differ by upper and lower case only: {named}. Each counts"
        " as a unit; if they are one, correct session.toml and run fieldcal batch again"
    )


def untimed_sentence(found: LotAnalysis) -> str:
    """Sentence about units whose time is unknown."""
    which = "1 unit" if found.untimed == 1 else f"{found.untimed} units"
    return f"{which} of unknown time: not in the control charts"


def _stated_levels(useful: Sequence[StoredSession]) -> list[dict[str, str]]:
    """Levels of each unit; a group of their own if some units do not state one."""
    stated = [name for name in LEVELS if any(name in one.levels for one in useful)]
    return [{**dict.fromkeys(stated, NOT_STATED), **one.levels} for one in useful]


def _find_odd_units(
    useful: Sequence[StoredSession], parameters: Mapping[str, LotParameter], rate: float
) -> list[OddUnit]:
    """Odd units; how the base stood in a session is no property of the unit."""
    names = [n for n in parameters if group_of(n) not in TILTS]
    chances = np.full((len(useful), len(names)), np.nan)
    off, sigma = chances.copy(), chances.copy()
    for k, name in enumerate(names):
        one = parameters[name]
        chances[one.unit_numbers, k] = one.distribution.tail_probabilities(one.x)
        off[one.unit_numbers, k], sigma[one.unit_numbers, k] = (
            one.x - one.distribution.mean,
            one.distribution.sigma,
        )
    together = unit_p_values(chances)
    out = []
    for i in np.flatnonzero(benjamini_hochberg(together, rate)).tolist():
        k = int(np.nanargmin(chances[i]))
        unit = useful[i]
        out.append(
            OddUnit(
                unit.serial, unit.folder, names[k], float(off[i, k]),
                float(sigma[i, k]), float(together[i]),
            )
        )  # fmt: skip
    return sorted(out, key=lambda one: one.probability)


def _find_shifts(one: LotParameter, levels: Sequence[Grouping]) -> list[Shift]:
    some = []
    for level in levels:
        labels = [level.labels[i] for i in level.index[one.unit_numbers]]
        made = Grouping.of(" or ".join(level.names), labels)
        if len(made.labels) > 1:
            some.append(made)
    return find_shifts(one.name, one.x, one.sigma, one.distribution, some)


def _find_alarms(one: LotParameter, useful: Sequence[StoredSession]) -> list[Alarm]:
    def named(number: int) -> str:
        unit = useful[int(one.unit_numbers[one.untimed + number])]
        return unit.serial or unit.folder

    return [
        Alarm(
            one.name,
            chart.name,
            named(chart.alarm),
            named(chart.onset),
        )
        for chart in one.charts
        if chart.alarm is not None and chart.onset is not None
    ]
