"""Sessions at several temperatures to polynomials, each group of parameters by itself.

Which orders, sizes, shares and spreads are tried is said here; what they are, and how
each counts by its evidence, in `group_fit`: v of (2), tau of (4), theta' of (3) there.
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
from fieldcal.thermal.group_fit import SHARES, GroupData, fitted, missed
from fieldcal.thermal.points import ThermalPoint

FEWEST, NARROWEST_K = 3, 10.0
"""So many temperatures over so wide a range; ArduPilot asks for the same range."""

DISTINCT = 0.1
"""Temperatures are two from this share of the range on."""

SIZES = tuple(float(v) for v in np.geomspace(0.01, 10.0, 10))
"""v of (2), in what the catalogue calls typical times h."""

SPREADS = tuple(float(v) for v in np.geomspace(1e-3, 3.0, 11))
"""tau of (4), in what is usual from run to run for the grade."""

ALIKE = {"cross_coupling": "acc_scale", "gyro_cross_coupling": "gyr_scale"}
"""Whose run-to-run spread is that of a group that no grade has one for."""

NEGLIGIBLE = 1e-4
"""Weight from which a set is tried again where sessions are held out."""

PASSES = 2
"""How often theta' in (3) is taken from the fit before."""


def thermal_model(points: Sequence[ThermalPoint], limits: GradeLimits) -> ThermalModel:
    """Polynomials of every group of parameters that all sessions have.

    Parameters
    ----------
    points : a session each, of one device
    limits : of its grade

    Raises
    ------
    InputError
        If temperatures are too few or too close to each other, or the sessions have no
        group in common.

    """
    warm = np.array([p.temperature for p in points])
    _refuse_few(warm)
    low, high = float(warm.min()), float(warm.max())
    middle, half = (low + high) / 2, (high - low) / 2
    curves: dict[str, ThermalCurve] = {}
    for names in common(points):
        group = group_of(names[0])
        usual = limits.repeat(ALIKE.get(group, group)) or 0.0
        sets = _sets(_typical(group) * half, usual)
        data = _data(points, names, (warm - middle) / half, half)
        for _ in range(PASSES):
            found = fitted(data, sets)
            data = data.tilted(found.slopes(data.x) / half)
        some = sets[found.weights > NEGLIGIBLE]
        left_out = np.array([missed(data, some, i) for i in range(len(points))])
        unit = GROUPS[group][2]
        for j, name in enumerate(names):
            curves[name] = found.curve(j, half, unit, left_out[:, j])
    if not curves:
        raise InputError(
            "the sessions have no group of parameters in common: solve them alike"
        )
    where = tuple((p.name, p.temperature) for p in points)
    return ThermalModel(curves, middle, low, high, where)


def common(points: Sequence[ThermalPoint]) -> list[list[str]]:
    """Names of the parameters of each group that all points have, whole."""
    sets = [p.calibration.names for p in points]
    groups: dict[str, list[str]] = {}
    for name in dict.fromkeys(n for names in sets for n in names):
        if group_of(name) in GROUPS:
            groups.setdefault(group_of(name), []).append(name)
    return [g for g in groups.values() if all(set(g) <= set(names) for names in sets)]


def _refuse_few(warm: Array) -> None:
    """Refuse temperatures that tell no curve."""
    wide = float(np.ptp(warm)) if len(warm) else 0.0
    count, last = 0, -np.inf
    for t in np.sort(warm):
        if t - last >= DISTINCT * wide:
            count, last = count + 1, float(t)
    if count < FEWEST or wide < NARROWEST_K:
        listed = ", ".join(f"{t:.1f}" for t in warm)
        raise InputError(
            f"the sessions were taken at {listed} °C: at least {FEWEST} temperatures"
            f" over {NARROWEST_K:.0f} K are needed; record at others"
        )


def _typical(group: str) -> float:
    """What the catalogue calls typical of a group's change in a kelvin."""
    if group == "acc_bias":
        return TemperatureBias.params[0].typical
    if group == "gyr_bias":
        return TemperatureBias.params[3].typical
    return TemperatureScale.params[0].typical


def _sets(size: float, usual: float) -> Array:
    """Every n, v, r, tau that is tried, (m, 4).

    All four orders always: what too few temperatures cannot tell is wide in the ±.
    """
    grid = np.meshgrid(
        np.arange(TERMS), np.array(SIZES) * size, [*SHARES], np.array(SPREADS) * usual
    )
    return np.stack([g.ravel() for g in grid], axis=1)


def _data(
    points: Sequence[ThermalPoint], names: Sequence[str], x: Array, half: float
) -> GroupData:
    """Rows of a group; theta' is that of a straight line to begin with."""
    every = [p.calibration for p in points]
    at = [[c.names.index(n) for n in names] for c in every]
    y = np.array([c.values[i] for c, i in zip(every, at, strict=True)])
    covariance = np.array(
        [c.covariance[np.ix_(i, i)] for c, i in zip(every, at, strict=True)]
    )
    offset = y.mean(axis=0)
    slope = np.polynomial.polynomial.polyfit(x, y - offset, 1)[1] / half
    wander = np.array([p.wander for p in points])
    tilt = np.broadcast_to(slope, y.shape)
    return GroupData(x, y - offset, offset, covariance, wander, tilt)
