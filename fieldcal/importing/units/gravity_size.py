"""What gravity reads in the numbers of a file, by its rests.

    |a| at rest is g                                                               (1)

tells m/s^2, g, mg and counts of the usual full scales apart, once the offset of raw
counts is known from rests in many directions (a sphere through their means).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.importing.recording import MAX_READING
from fieldcal.importing.units.scales import MIN_ROWS, MIN_ROWS_ALONE

FEWEST_MEANS, MOST_MEANS = 3, 200
"""Rows of a table of means, one for each position."""

FEWEST_FACES, FEWEST_ON_SPHERE = 6, 9
"""Rows on a sphere that show its middle: of rows in all directions, and of others."""

MIN_ROW_ANGLE_RAD = np.deg2rad(10.0)
"""Angle between successive rows that samples do not have, rad."""

MOST_AT_REST, FINEST_COUNTS = 5.0, 131.072
"""Most by which rates at rest differ from position to position, deg/s: rad/s, by less;
and the most counts that are usual in a deg/s."""

BETWEEN_POSITIONS_S = 1.0
"""Least time from one position to the next, s: a hand that shakes a device turns it by
as much between two samples."""

_ALIKE = 0.15
"""Part by which lengths of means in a table of them differ."""

_GROUP = 8
"""Rows of which the mean is taken for (1)."""

_QUIET = 0.3
"""Part of these groups that is taken for rest, the quietest."""

_MIXED = 0.1
"""Part of |a| that rows of a group differ by where they are of two positions, and that
most rows do not differ by from the row before."""

_ROUND = 0.03
"""Departure from a sphere, over its radius, of means that lie on one."""

_STEPS = 30
"""Steps to the middle of a sphere of a known radius."""

_WIDE = 0.05
"""Least share of the directions' variance along any axis, for a sphere."""

_BOX = 0.93
"""Steps of the numbers in the radius of a sphere, at least. A device at rest changes
between two neighbouring numbers on each axis, and the corners of that box lie on a
sphere of sqrt(3) / 2 steps whatever it measures; six faces are one step out or more."""


_UNEQUAL = 5 / 3
"""Ratio of lengths at rest that no bias makes, which is a quarter of g at most."""


class GravityReading(NamedTuple):
    """Gravity as the accelerometers read it, in numbers of the file.

    Attributes
    ----------
    size : |a|, less the offset where that is known
    offset : (3,) 0 where it is not
    round : whether it is known

    """

    size: float
    offset: Array
    round: bool


def _readings(acc: Array) -> Array:
    """Rows (m, 3) that a sensor may have measured."""
    rows: Array = acc[(np.abs(acc) < MAX_READING).all(axis=1)]
    return rows


def are_means(acc: Array, t: Array | None = None, gyr: Array | None = None) -> bool:
    """Whether rows (n, 3) are means of positions: successive directions differ.

    Samples that follow each other point nearly the same way; means of positions do not.
    Times (n,), s, are those of rows; a unit that nobody says is taken for s. Rates
    (n, 3), deg/s or in the numbers of the file, are those of a device at rest then.
    """
    if t is not None and _follow_at_once(t):
        return False
    if gyr is not None and _are_of_turns(gyr):
        return False
    acc = _readings(acc)
    if not FEWEST_MEANS <= len(acc) <= MOST_MEANS:
        return False
    # a large offset hides how much the directions differ
    center, radius = _fit_sphere(acc, FEWEST_FACES)
    acc = acc - center if radius else acc
    length = np.linalg.norm(acc, axis=1)
    if not length.all():
        return False
    usual = float(np.median(length))
    if np.quantile(np.abs(length / usual - 1), 0.8) > _ALIKE:
        return False
    up = acc / length[:, None]
    turned = np.arccos(np.clip((up[1:] * up[:-1]).sum(axis=1), -1, 1))
    return bool(np.median(turned) > MIN_ROW_ANGLE_RAD)


def _are_of_turns(gyr: Array) -> bool:
    """Whether rates (n, 3), counts if they are whole, differ as at no rests."""
    known = gyr[np.isfinite(gyr).all(axis=1)]
    if not len(known):
        return False
    whole = bool((known == np.round(known)).all())
    most = MOST_AT_REST * (FINEST_COUNTS if whole else 1.0)
    return bool(np.ptp(known, axis=0).max() > most)


def _follow_at_once(t: Array) -> bool:
    """Whether rows of times (n,), s, come sooner than anybody takes a position."""
    steps = np.diff(t[np.isfinite(t)])
    steps = steps[steps > 0]
    return bool(len(steps) and np.median(steps) < BETWEEN_POSITIONS_S)


def estimate_gravity(
    acc: Array, t: Array | None = None, means: bool = False
) -> GravityReading | None:
    """Size of gravity in numbers (n, 3) of a file, by (1); None of too few.

    `t` (n,) are the times of the rows, as in `are_means`; `means` says that they are.
    """
    means = means or are_means(acc, t)
    acc = _readings(acc)
    if means:
        return _gravity_of(acc) if len(acc) else None
    if len(acc) < MIN_ROWS_ALONE:
        return None
    # of so few, no part is quieter than the others
    return _gravity_of(
        _quiet_means(acc) if len(acc) >= MIN_ROWS else acc[:MIN_ROWS_ALONE]
    )


def unequal_lengths(acc: Array) -> tuple[float, float] | None:
    """Lengths that numbers (n, 3) have where they change least, if (1) fits none.

    Gravity is the same at every rest. None if they are alike, lie on a sphere, are too
    few to tell, or an axis is dead. Rows of zeros hold nothing.
    """
    acc = _readings(acc[acc.any(axis=1)])
    if len(acc) < MIN_ROWS or are_means(acc) or not np.ptp(acc, axis=0).all():
        return None
    quiet = _quiet_means(acc)
    low, high = np.quantile(np.linalg.norm(quiet, axis=1), (0.1, 0.9)).tolist()
    if high <= _UNEQUAL * low or _fit_sphere(quiet)[1]:
        return None
    return low, high


def _quiet_means(acc: Array) -> Array:
    """Means (m, 3) of the quietest groups of rows; rows where groups mix attitudes.

    A few readings in each position differ little from row to row, and by much in any
    group, which has rows of two positions.
    """
    groups = acc[: len(acc) // _GROUP * _GROUP].reshape(-1, _GROUP, 3)
    means, spread = groups.mean(axis=1), groups.std(axis=1).max(axis=1)
    least = float(np.quantile(spread, _QUIET))
    usual = float(np.median(np.linalg.norm(acc, axis=1)))
    step = float(np.median(np.abs(np.diff(acc, axis=0)).max(axis=1)))
    if step < _MIXED * usual < least:
        return acc
    quiet: Array = means[spread <= least]
    return quiet


def _gravity_of(quiet: Array) -> GravityReading | None:
    """Size of gravity by means (m, 3) of rests."""
    center, radius = _fit_sphere(quiet)
    if radius:
        return GravityReading(radius, center, True)
    size = float(np.median(np.linalg.norm(quiet, axis=1)))
    return GravityReading(size, np.zeros(3), False) if size else None


def gravity_of_length(acc: Array, size: float) -> GravityReading | None:
    """Gravity of a known length, with the offset that rests show; None if they do not.

    Rests in few directions lie on many spheres, but on one of a known radius.
    """
    acc = _readings(acc)
    if len(acc) < MIN_ROWS:
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
    return GravityReading(size, center, True)


def _fit_sphere(points: Array, fewest: int = FEWEST_ON_SPHERE) -> tuple[Array, float]:
    """Center and radius of a sphere through points; radius 0 if they lie on none.

    Nor do fewer than `fewest` tell one.
    """
    middle = points.mean(axis=0)
    unit = float(np.abs(points - middle).max()) or 1.0
    x = (points - middle) / unit
    # |x|^2 = 2 c x + r^2 - c^2
    left = np.column_stack([2 * x, np.ones(len(x))])
    found, *_, singular = np.linalg.lstsq(left, (x**2).sum(axis=1), rcond=None)
    if len(x) < fewest or singular[-1] < 1e-3 * singular[0]:
        return middle, 0.0
    radius = float(np.sqrt(max(found[3] + found[:3] @ found[:3], 0.0)))
    away = x - found[:3]
    if not radius:
        return middle, 0.0
    departs = np.abs(np.linalg.norm(away, axis=1) / radius - 1)
    share = np.linalg.eigvalsh(np.cov(away.T))[0] / radius**2
    if np.quantile(departs, 0.9) > _ROUND or share < _WIDE:
        return middle, 0.0
    if unit * radius < _BOX * _step_of_numbers(points):
        return middle, 0.0
    return middle + unit * found[:3], unit * radius


def _step_of_numbers(points: Array) -> float:
    """Largest of the steps (m, 3) numbers take on an axis; 0 if they never change.

    >>> _step_of_numbers(np.array([[2.0, 1.0, 0.0], [2.5, 1.0, 0.0], [3.5, 1.0, 0.0]]))
    0.5
    """
    # sums of binary fractions differ in their last digit
    steps = np.diff(np.sort(points, axis=0), axis=0)
    steps[steps < 1e-9 * np.abs(points).max()] = np.inf
    least = steps.min(axis=0)
    return float(least.max(where=np.isfinite(least), initial=0.0))
