"""Earlier calibrations of a device as they would be at the present temperature.

A value x_i of T_i is compared with one of T as

    x_i + theta(T) - theta(T_i),   u_i                                             (1)

with theta and the uncertainty u_i of the difference from the earlier calibrations
themselves (`thermal`), or, where they do not show it, theta = 0 and

    u_i = c |T - T_i|                                                              (2)

with c the usual temperature coefficient of the grade. All u_i are one common error; the
uncertainty of the comparison is their mean. A run on a cold day is therefore not taken
for a broken device.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.acceptance.temperature import NEAR_K, as_thermal_point
from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.calibration.names import group_of
from fieldcal.core.errors import InputError
from fieldcal.history.store import HistoryRun
from fieldcal.thermal import ThermalModel, thermal_model


@dataclass(frozen=True, slots=True)
class FamilyAtTemperature:
    """Earlier calibrations at the present temperature.

    Attributes
    ----------
    calibrations : values of (1), oldest first
    sigma : mean of u_i by full name; empty where all were taken at this temperature

    """

    calibrations: Sequence[Calibration]
    sigma: Mapping[str, float]


def family_at_temperature(
    calibration: Calibration, earlier: Sequence[HistoryRun], limits: GradeLimits
) -> FamilyAtTemperature:
    """Earlier calibrations at the temperature of the present one, (1), (2).

    Parameters
    ----------
    calibration : the present calibration
    earlier : calibrations that it is compared with, oldest first
    limits : limits of its grade

    """
    now = as_thermal_point("now", calibration)
    points = [as_thermal_point(run.taken_at, run.calibration) for run in earlier]
    known = [p for p in points if p is not None]
    if now is None or all(
        abs(p.temperature - now.temperature) <= NEAR_K for p in known
    ):
        return FamilyAtTemperature([run.calibration for run in earlier], {})
    try:
        model: ThermalModel | None = thermal_model(known, limits)
    except InputError:
        model = None
    moved, wide = [], []
    for run, p in zip(earlier, points, strict=True):
        then = now.temperature if p is None else p.temperature
        change = _change(run.calibration, now.temperature, then, model, limits)
        values = run.calibration.values + change[:, 0]
        moved.append(replace(run.calibration, values=values))
        wide.append(
            dict(zip(run.calibration.names, change[:, 1].tolist(), strict=True))
        )
    names = dict.fromkeys(name for each in wide for name in each)
    sigma = {n: float(np.mean([w[n] for w in wide if n in w])) for n in names}
    return FamilyAtTemperature(moved, sigma)


def _change(
    of: Calibration,
    now: float,
    then: float,
    model: ThermalModel | None,
    limits: GradeLimits,
) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Difference and its uncertainty of each parameter, (k, 2)."""
    told: Mapping[str, tuple[float, float]] = {}
    if model is not None:
        try:
            told = model.change(now, then)
        except InputError:
            told = {}  # outside the temperatures of earlier calibrations
    usual = {n: (0.0, limits.per_kelvin(group_of(n)) * abs(now - then))
             for n in of.names}  # fmt: skip
    return np.array([told.get(name, usual[name]) for name in of.names]).reshape(-1, 2)
