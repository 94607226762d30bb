"""Fits polynomials over temperature to sessions, for each group of parameters.

This module defines the grid of orders, sizes, shares and spreads. `group_fit` defines
their meaning and weighs them by their evidence: v of (2), theta' of (3) and tau of (4)
are in its equations.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.calibration.gauge import GROUPS
from fieldcal.calibration.limits import GradeLimits
from fieldcal.calibration.names import group_of
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.effects.temperature_bias import TemperatureBias
from fieldcal.effects.temperature_scale import TemperatureScale
from fieldcal.thermal.curves import TERMS, ThermalCurve, ThermalModel
from fieldcal.thermal.group_fit import SHARES, GroupData, fit_group, held_out_residual
from fieldcal.thermal.points import ThermalPoint

MIN_TEMPERATURES, MIN_RANGE_K = 3, 10.0
"""Least number of temperatures, and least range; ArduPilot needs the same range."""

DISTINCT_SHARE = 0.1
"""Least distance of distinct temperatures, as a share of the range."""

SIZES = tuple(float(v) for v in np.geomspace(0.01, 10.0, 10))
"""v of (2), over h times the typical size of the effect in the catalogue."""

SPREADS = tuple(float(v) for v in np.geomspace(1e-3, 3.0, 11))
"""tau of (4), over the usual spread from run to run of the grade."""

SPREAD_OF_GROUP = {"cross_coupling": "acc_scale", "gyro_cross_coupling": "gyr_scale"}
"""Group whose spread from run to run is taken for a group that has no limit."""

NEGLIGIBLE = 1e-4
"""Least weight of a set that is fitted again with a session held out."""

PASSES = 2
"""Number of fits, each with theta' of (3) from the one before."""


def thermal_model(points: Sequence[ThermalPoint], limits: GradeLimits) -> ThermalModel:
    """Fit polynomials to every group of parameters that all sessions have.

    Parameters
    ----------
    points : one for each session of a device
    limits : of the device's grade

    Raises
    ------
    InputError
        If temperatures are too few or too close to each other, or the sessions have no
        group in common.

    """
    warm = np.array([p.temperature for p in points])
    _check_temperatures(warm)
    low, high = float(warm.min()), float(warm.max())
    middle, half = (low + high) / 2, (high - low) / 2
    curves: dict[str, ThermalCurve] = {}
    for names in common_parameters(points):
        group = group_of(names[0])
        usual = limits.repeat(SPREAD_OF_GROUP.get(group, group)) or 0.0
        sets = _hyperparameter_grid(_typical_change(group) * half, usual)
        data = _group_data(points, names, (warm - middle) / half, half)
        for _ in range(PASSES):
            found = fit_group(data, sets)
            data = data.with_slope(found.slopes(data.x) / half)
        some = sets[found.weights > NEGLIGIBLE]
        left_out = np.array(
            [held_out_residual(data, some, i) for i in range(len(points))]
        )
        unit = GROUPS[group][2]
        for j, name in enumerate(names):
            curves[name] = found.curve(j, half, unit, left_out[:, j])
    if not curves:
        raise InputError(
            "the sessions have no group of parameters in common: solve them alike"
        )
    where = tuple((p.name, p.temperature) for p in points)
    return ThermalModel(curves, middle, low, high, where)


def common_parameters(points: Sequence[ThermalPoint]) -> list[list[str]]:
    """Parameter names of each group that is complete in all points."""
    sets = [p.calibration.names for p in points]
    groups: dict[str, list[str]] = {}
    for name in dict.fromkeys(n for names in sets for n in names):
        if group_of(name) in GROUPS:
            groups.setdefault(group_of(name), []).append(name)
    return [g for g in groups.values() if all(set(g) <= set(names) for names in sets)]


def _check_temperatures(warm: Array) -> None:
    """Refuse temperatures that are too few or too close to each other."""
    wide = float(np.ptp(warm)) if len(warm) else 0.0
    count, last = 0, -np.inf
    for t in np.sort(warm):
        if t - last >= DISTINCT_SHARE * wide:
            count, last = count + 1, float(t)
    if count < MIN_TEMPERATURES or wide < MIN_RANGE_K:
        listed = ", ".join(f"{t:.1f}" for t in warm)
        raise InputError(
            f"the sessions were taken at {listed} °C: at least {MIN_TEMPERATURES}"
            f" temperatures over {MIN_RANGE_K:.0f} K are needed; record at others"
        )


def _typical_change(group: str) -> float:
    """Typical change of a group's parameters per kelvin, from the catalogue."""
    if group == "acc_bias":
        return TemperatureBias.params[0].typical
    if group == "gyr_bias":
        return TemperatureBias.params[3].typical
    return TemperatureScale.params[0].typical


def _hyperparameter_grid(size: float, usual: float) -> Array:
    """Grid of n, v, r and tau, (m, 4).

    It always has all four orders. Terms that few temperatures do not determine have
    large uncertainties.
    """
    grid = np.meshgrid(
        np.arange(TERMS), np.array(SIZES) * size, [*SHARES], np.array(SPREADS) * usual
    )
    return np.stack([g.ravel() for g in grid], axis=1)


def _group_data(
    points: Sequence[ThermalPoint], names: Sequence[str], x: Array, half: float
) -> GroupData:
    """Values of a group in all sessions, with the slope of a straight line."""
    every = [p.calibration for p in points]
    at = [[c.names.index(n) for n in names] for c in every]
    y = np.array([c.values[i] for c, i in zip(every, at, strict=True)])
    covariance = np.array(
        [c.covariance[np.ix_(i, i)] for c, i in zip(every, at, strict=True)]
    )
    offset = y.mean(axis=0)
    slope = np.polynomial.polynomial.polyfit(x, y - offset, 1)[1] / half
    temperature_sd = np.array([p.temperature_sd for p in points])
    slope = np.broadcast_to(slope, y.shape)
    return GroupData(x, y - offset, offset, covariance, temperature_sd, slope)
