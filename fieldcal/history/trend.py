"""One parameter of a device from run to run, and which runs are out of family.

Each run is compared with the distribution from the earlier runs of its family
(`family`). The probability of a false alarm is divided among the parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fieldcal.calibration.limits import GradeLimits
from fieldcal.calibration.names import group_of
from fieldcal.history.family import next_run_distribution
from fieldcal.history.store import HistoryRun, family_runs


@dataclass(frozen=True, slots=True)
class TrendPoint:
    """One run's value of a parameter.

    Attributes
    ----------
    run : the run
    value, sigma : of the parameter
    unit : of both
    chance : probability of such a value according to the earlier runs; nan for the
        first
    out_of_family : whether it is out of family
    spread : standard deviation from run to run, including this run; nan if the grade
        has none for the parameter

    """

    run: HistoryRun
    value: float
    sigma: float
    unit: str
    chance: float
    out_of_family: bool
    spread: float

    def to_json(self) -> dict[str, Any]:
        """Return a JSON object; null where not known."""
        chance = self.chance if np.isfinite(self.chance) else None
        return {
            "number": self.run.number,
            "value": self.value,
            "sigma": self.sigma,
            "unit": self.unit,
            "chance": chance,
            "out_of_family": self.out_of_family,
            "spread": self.spread if np.isfinite(self.spread) else None,
        }


def parameter_names(runs: Sequence[HistoryRun]) -> tuple[str, ...]:
    """Names of the parameters of all runs, in order."""
    return tuple(dict.fromkeys(n for run in runs for n in run.calibration.names))


def parameter_trend(
    runs: Sequence[HistoryRun], name: str, limits: GradeLimits
) -> list[TrendPoint]:
    """Values of one parameter from run to run, oldest first.

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
        before = _values_and_sigmas(family_runs(runs[:i]), name)
        together = max(1, sum(limits.repeat(group_of(n)) is not None
                              for n in found.names))  # fmt: skip
        if usual is not None:
            if len(before):
                usually = next_run_distribution(before[:, 0], before[:, 1], usual)
                apart = _temperature_difference(run, family_runs(runs[:i]))
                warmth = apart * limits.per_kelvin(group_of(name))
                chance = usually.chance(value, float(np.hypot(sigma, warmth)))
            known = _values_and_sigmas(family_runs(runs[: i + 1]), name)
            shown = known if len(known) else np.array([[value, sigma]])
            spread = next_run_distribution(shown[:, 0], shown[:, 1], usual).spread
        odd = bool(chance < limits.family_chance / together)
        points.append(TrendPoint(run, value, sigma, unit, chance, odd, spread))
    return points


def _temperature_difference(run: HistoryRun, before: Sequence[HistoryRun]) -> float:
    """Difference of the temperature from the mean of earlier runs, K; 0 if unknown."""
    known = [r.temperature for r in before if r.temperature is not None]
    if run.temperature is None or not known:
        return 0.0
    return abs(run.temperature - float(np.mean(known)))


def _values_and_sigmas(runs: Sequence[HistoryRun], name: str) -> np.ndarray[Any, Any]:
    rows = [
        (run.calibration.value(name), run.calibration.uncertainty(name))
        for run in runs
        if name in run.calibration.names
    ]
    return np.array(rows).reshape(-1, 2)
