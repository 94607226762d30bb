"""Units that a file does not say, told by the physics of what it holds.

    |a| at rest is g                                                               (1)
    d(u)/dt = u x w,   u = a / |a|                                                 (2)

(1) tells m/s^2, g, mg and counts of the usual full scales apart, once the offset of raw
counts is known from rests in many directions (a sphere through their means). (2), as
gravity turns in device axes while the device is turned, gives the scale of the rates.
A logger writes 1 to 8000 samples a second, which tells s, ms, us and ns apart.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array

FEWEST = 50
"""Rows that tell anything."""

FEWEST_MEANS, MOST_MEANS = 3, 200
"""Rows of a table of means, one for each position."""

APART = np.deg2rad(10.0)
"""Angle between successive rows that samples do not have, rad."""

_ALIKE = 0.15
"""Part by which lengths of means in a table of them differ."""

_GROUP = 8
"""Rows of which the mean is taken for (1)."""

_QUIET = 0.3
"""Part of these groups that is taken for rest, the quietest."""

_ROUND = 0.03
"""Departure from a sphere, over its radius, of means that lie on one."""

_STEPS = 30
"""Steps to the middle of a sphere of a known radius."""

_WIDE = 0.05
"""Least share of the directions' variance along any axis, for a sphere."""

ACC_OUT = (0.06, 0.15)
"""Logarithm of what factory scales are out by: offset known, and not."""

GYR_OUT = (0.05, 0.25)
"""Likewise of (2), where an offset tilts the gravity that is seen to turn."""

_TURNED = 0.5
"""Turn of gravity that all of a recording must have for (2), rad."""

_AGREES = 0.9
"""Correlation of both sides of (2) from which on it is believed."""

_SWUNG = 0.3
"""Part by which |a| is not g: then a hand is felt, and (2) does not hold."""

_OFTEN, _RAIL = 5, 1.5
"""Rows at one value that are a rail, and how far it is out, in standard deviations."""

_LAG = 0.5
"""Time over which (2) is integrated, s: jerks of a hand are shorter."""


class Scale(NamedTuple):
    """A way to read numbers as a quantity.

    Attributes
    ----------
    size : what the quantity reads in it: |a| at rest, or 1 rad/s
    unit, lsb : as the user would give it

    """

    size: float
    unit: str
    lsb: float = 1.0

    def __str__(self) -> str:
        """Say it: "g" or "counts of 16384 in one g"."""
        return (
            self.unit if self.lsb == 1 else f"counts, {self.lsb:.6g} in a {self.unit}"
        )


def _counts(per_unit: float) -> float:
    """Counts of 16 bits in a unit, by the full scale."""
    return 2**15 / per_unit


_G_COUNTS = (
    *(_counts(full) for full in (2, 3, 4, 6, 8, 12, 16, 24, 32)),
    *(512.0, 256.0, 128.0, 64.0),
)
_DEG_COUNTS = (
    *(_counts(full) for full in (125, 250, 500, 1000, 2000)),
    *(1 / milli for milli in (8.75e-3, 17.5e-3, 35e-3, 70e-3)),
)

ACC_SCALES = (
    Scale(G0, "m/s^2"),
    Scale(1.0, "g"),
    Scale(1000.0, "mg"),
    *(Scale(c, "g", c) for c in _G_COUNTS),
)
GYR_SCALES = (
    Scale(1.0, "rad/s"),
    Scale(180 / np.pi, "deg/s"),
    Scale(1000.0, "mrad/s"),
    *(Scale(c * 180 / np.pi, "deg/s", c) for c in _DEG_COUNTS),
)

RATES_HZ = (1.0, 8000.0)
"""What a logger of an IMU writes in a second."""

SHORTEST = 5.0
"""Shortest recording, s, where another unit of time makes it longer."""

TIME_SIZES = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}

UNIX = (1e9, 4e9)
"""Times of day since 1970, s: 2001 to 2096."""


class Gravity(NamedTuple):
    """What the accelerometers read at rest, in numbers of the file.

    Attributes
    ----------
    size : |a|, less the offset where that is known
    offset : (3,) 0 where it is not
    round : whether it is known

    """

    size: float
    offset: Array
    round: bool


def are_means(acc: Array) -> bool:
    """Whether successive rows (n, 3) point so differently that they are no samples.

    Samples that follow each other point nearly the same way; means of positions do not.
    """
    acc = acc[np.isfinite(acc).all(axis=1)]
    length = np.linalg.norm(acc, axis=1)
    if not FEWEST_MEANS <= len(acc) <= MOST_MEANS or not length.all():
        return False
    usual = float(np.median(length))
    if np.quantile(np.abs(length / usual - 1), 0.8) > _ALIKE:
        return False
    up = acc / length[:, None]
    turned = np.arccos(np.clip((up[1:] * up[:-1]).sum(axis=1), -1, 1))
    return bool(np.median(turned) > APART)


def gravity_in(acc: Array) -> Gravity | None:
    """Size of gravity in numbers (n, 3) of a file, by (1); None of too few."""
    acc = acc[np.isfinite(acc).all(axis=1)]
    if are_means(acc):
        return _gravity_of(acc)
    if len(acc) < FEWEST:
        return None
    return _gravity_of(_quiet_means(acc))


def _quiet_means(acc: Array) -> Array:
    """Means (m, 3) of the quietest groups of rows."""
    groups = acc[: len(acc) // _GROUP * _GROUP].reshape(-1, _GROUP, 3)
    means, spread = groups.mean(axis=1), groups.std(axis=1).max(axis=1)
    quiet: Array = means[spread <= np.quantile(spread, _QUIET)]
    return quiet


def _gravity_of(quiet: Array) -> Gravity | None:
    """Size of gravity by means (m, 3) of rests."""
    center, radius = _sphere(quiet)
    if radius:
        return Gravity(radius, center, True)
    size = float(np.median(np.linalg.norm(quiet, axis=1)))
    return Gravity(size, np.zeros(3), False) if size else None


def with_length(acc: Array, size: float) -> Gravity | None:
    """Gravity of a known length, with the offset that rests show; None if they do not.

    Rests in few directions lie on many spheres, but on one of a known radius.
    """
    acc = acc[np.isfinite(acc).all(axis=1)]
    if len(acc) < FEWEST:
        return None
    x = _quiet_means(acc)
    center = x.mean(axis=0)
    for _ in range(_STEPS):
        away = x - center
        length = np.maximum(np.linalg.norm(away, axis=1), 1e-12)
        out = away / length[:, None]
        center = center + np.linalg.lstsq(out, length - size, rcond=1e-3)[0]
    length = np.linalg.norm(x - center, axis=1)
    spread = float(np.linalg.norm(x.std(axis=0)))
    if spread < size / 2 or np.quantile(np.abs(length / size - 1), 0.9) > _ROUND:
        return None
    return Gravity(size, center, True)


def _sphere(points: Array) -> tuple[Array, float]:
    """Center and radius of a sphere through points; radius 0 if they lie on none."""
    middle = points.mean(axis=0)
    unit = float(np.abs(points - middle).max()) or 1.0
    x = (points - middle) / unit
    # |x|^2 = 2 c x + r^2 - c^2
    left = np.column_stack([2 * x, np.ones(len(x))])
    found, *_, singular = np.linalg.lstsq(left, (x**2).sum(axis=1), rcond=None)
    if len(x) < 9 or singular[-1] < 1e-3 * singular[0]:
        return middle, 0.0
    radius = float(np.sqrt(max(found[3] + found[:3] @ found[:3], 0.0)))
    away = x - found[:3]
    if not radius:
        return middle, 0.0
    departs = np.abs(np.linalg.norm(away, axis=1) / radius - 1)
    share = np.linalg.eigvalsh(np.cov(away.T))[0] / radius**2
    if np.quantile(departs, 0.9) > _ROUND or share < _WIDE:
        return middle, 0.0
    return middle + unit * found[:3], unit * radius


def fitting(size: float, scales: tuple[Scale, ...], within: float) -> list[Scale]:
    """Ways to read a quantity that shows as `size`, within a factor, nearest first.

    Parameters
    ----------
    size, scales : what it shows as, and what it might
    within : logarithm of the factor

    """
    away = {s: abs(float(np.log(size / s.size))) for s in scales}
    return sorted((s for s in scales if away[s] <= within), key=away.__getitem__)


def rate_in(t: Array, acc: Array, gyr: Array, gravity: Gravity) -> float | None:
    """What 1 rad/s reads in numbers (n, 3) of a file, by (2); None if nothing turns.

    Parameters
    ----------
    t : (n,) s
    acc, gyr : (n, 3) in numbers of the file
    gravity : what the accelerometers read at rest

    """
    known = np.isfinite(np.column_stack([t, acc, gyr])).all(axis=1)
    t, acc, gyr = t[known], acc[known], gyr[known]
    if len(t) < FEWEST:
        return None
    steps = np.diff(t)
    steps[(steps > _LAG) | (steps < 0)] = np.nan
    step = float(np.nanmean(steps)) if np.isfinite(steps).any() else 0.0
    lag = max(2, round(_LAG / step)) if step > 0 else len(t)
    if len(t) < 4 * lag:
        return None
    clipped = _at_rails(gyr)
    up = (acc - gravity.offset) / gravity.size
    length = np.maximum(np.linalg.norm(up, axis=1), 0.1)
    up, gyr = up / length[:, None], gyr - np.median(gyr, axis=0)
    turning = np.cross(up, gyr)
    swung = (np.abs(length - 1) > _SWUNG) | clipped
    steps[swung[1:] | swung[:-1]] = np.nan
    middle = (turning[1:] + turning[:-1]) / 2 * steps[:, None]
    right = _over(middle, lag)
    left = up[lag:] - up[:-lag]
    whole = np.isfinite(right).all(axis=1)
    left, right = left[whole].ravel(), right[whole].ravel()
    power, moved = float(right @ right), float(left @ left)
    if not power or moved < _TURNED**2 * lag:
        return None
    both = float(left @ right)
    if both < _AGREES * np.sqrt(power * moved):
        return None
    return power / both


def _at_rails(gyr: Array) -> NDArray[np.bool_]:
    """Rows (n, 3) in which an axis is at the greatest or least value, again and again.

    An output that is clipped says less than the rate, so it tells no scale.
    """
    ends = np.array([gyr.min(axis=0), gyr.max(axis=0)])
    often = [(gyr == end).sum(axis=0) >= _OFTEN for end in ends]
    turns = np.abs(ends - np.median(gyr, axis=0)) > _RAIL * gyr.std(axis=0)
    low, high = ((gyr == ends[i]) & often[i] & turns[i] for i in (0, 1))
    rails: NDArray[np.bool_] = (low | high).any(axis=1)
    return rails


def _over(steps: Array, lag: int) -> Array:
    """Sums of `lag` successive steps (n, 3); nan over a pause."""
    paused = np.isnan(steps)
    total = np.cumsum(np.where(paused, 0.0, steps), axis=0)
    gaps = np.cumsum(paused, axis=0)
    total, gaps = (np.vstack([np.zeros((1, 3)), x]) for x in (total, gaps))
    sums: Array = total[lag:] - total[:-lag]
    sums[(gaps[lag:] > gaps[:-lag]).any(axis=1)] = np.nan
    return sums


def time_units(t: Array) -> list[str]:
    """Units that times (n,) of a file may be in."""
    t = t[np.isfinite(t)]
    steps = np.diff(t)
    steps = steps[steps > 0]
    if len(steps) < FEWEST:
        return []
    day = [u for u, n in TIME_SIZES.items() if UNIX[0] <= t[-1] / n < UNIX[1]]
    step = float(np.median(steps))
    low, high = RATES_HZ
    usual = [u for u, n in TIME_SIZES.items() if low <= n / step <= high]
    if both := [u for u in usual if u in day]:
        return both
    span = float(steps.sum())
    return [u for u in usual if span / TIME_SIZES[u] >= SHORTEST] or usual


def temperature_fits(values: Array) -> Mapping[str, float]:
    """Readings of temperatures (n,), with the median of each in deg C."""
    values = values[np.isfinite(values)]
    if not len(values):
        return {"degC": np.nan}
    low, middle, high = (float(f(values)) for f in (np.min, np.median, np.max))
    if -60 <= low and high <= 150:
        return {"degC": middle}
    found = {}
    if -6000 <= low and high <= 15000 and abs(middle) > 1000:
        found["cdegC"] = middle / 100
    if 213 <= low and high <= 423:
        found["K"] = middle - 273.15
    return found


_THERMOMETERS = ((256.0, 25.0), (340.0, 36.53), (333.87, 21.0))
"""Counts in 1 K, and deg C at count 0, of the usual sensors."""


def temperature_counts(low: float, high: float) -> list[str]:
    """Options that make deg C of counts from `low` to `high`, as the usual sensors do.

    >>> temperature_counts(65236, 65240)[0]
    '--temp-unit count --temp-lsb 256 --temp-zero -231 (23.8 to 23.8 deg C)'
    """
    wrapped = 2**16 if low >= 2**15 else 0
    found = []
    for lsb, zero in _THERMOMETERS:
        coldest, warmest = (zero + (n - wrapped) / lsb for n in (low, high))
        if -45 <= coldest and warmest <= 105:
            found.append(
                f"--temp-unit count --temp-lsb {lsb:g} --temp-zero"
                f" {zero - wrapped / lsb:.6g} ({coldest:.1f} to {warmest:.1f} deg C)"
            )
    return found or [
        "--temp-unit count --temp-lsb 256 --temp-zero 25 (counts in 1 K, deg C at count"
        " 0, as its data sheet says)"
    ]
