"""One parameter of a device from run to run, and which runs are out of family.

Each run is compared with what the family before it let expect (`family`), as it
was when it was made; the chance of a false alarm is shared by the parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fieldcal.calibration.limits import GradeLimits
from fieldcal.calibration.names import group_of
from fieldcal.history.family import expected
from fieldcal.history.store import HistoryRun, family


@dataclass(frozen=True, slots=True)
class TrendPoint:
    """One run's value of a parameter.

    Attributes
    ----------
    run : which
    value, sigma : of the parameter
    unit : of both
    chance : probability of such a value by the runs before; nan for the first
    odd : whether it is out of family
    spread : from run to run, as known with this run; nan where no grade says

    """

    run: HistoryRun
    value: float
    sigma: float
    unit: str
    chance: float
    odd: bool
    spread: float

    def to_json(self) -> dict[str, Any]:
        """Return it as an object; null where not known."""
        chance = self.chance if np.isfinite(self.chance) else None
        return {
            "number": self.run.number,
            "value": self.value,
            "sigma": self.sigma,
            "unit": self.unit,
            "chance": chance,
            "out_of_family": self.odd,
            "spread": self.spread if np.isfinite(self.spread) else None,
        }


def names(runs: Sequence[HistoryRun]) -> tuple[str, ...]:
    """Parameters that any run has, in order."""
    return tuple(dict.fromkeys(n for run in runs for n in run.calibration.names))


def trend(
    runs: Sequence[HistoryRun], name: str, limits: GradeLimits
) -> list[TrendPoint]:
    """Values of one parameter, oldest first.

    Parameters
    ----------
    runs : of one device, oldest first
    name : full name, as in ``acc_bias.x``
    limits : of its grade

    """
    usual = limits.repeat(group_of(name))
    points = []
    for i, run in enumerate(runs):
        found = run.calibration
        if name not in found.names:
            continue
        value, sigma = found.value(name), found.uncertainty(name)
        unit = found.units[found.names.index(name)]
        chance, spread = np.nan, np.nan
        before = _values(family(runs[:i]), name)
        together = max(1, sum(limits.repeat(group_of(n)) is not None
                              for n in found.names))  # fmt: skip
        if usual is not None:
            if len(before):
                usually = expected(before[:, 0], before[:, 1], usual)
                apart = _kelvins(run, family(runs[:i]))
                warmth = apart * limits.per_kelvin(group_of(name))
                chance = usually.chance(value, float(np.hypot(sigma, warmth)))
            known = _values(family(runs[: i + 1]), name)
            shown = known if len(known) else np.array([[value, sigma]])
            spread = expected(shown[:, 0], shown[:, 1], usual).spread
        odd = bool(chance < limits.family_chance / together)
        points.append(TrendPoint(run, value, sigma, unit, chance, odd, spread))
    return points


def _kelvins(run: HistoryRun, before: Sequence[HistoryRun]) -> float:
    """How far the temperature is from that of the runs before; 0 where not known."""
    known = [r.temperature for r in before if r.temperature is not None]
    if run.temperature is None or not known:
        return 0.0
    return abs(run.temperature - float(np.mean(known)))


def _values(runs: Sequence[HistoryRun], name: str) -> np.ndarray[Any, Any]:
    rows = [
        (run.calibration.value(name), run.calibration.uncertainty(name))
        for run in runs
        if name in run.calibration.names
    ]
    return np.array(rows).reshape(-1, 2)
