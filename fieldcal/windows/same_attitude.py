"""Whether the device has the same attitude after a disturbance as before.

A disturbance, such as a bump of the table, leaves two still stretches with a gap of g
seconds between them. theta is the lasting rotation of the device, b the jump of the
biases of the accelerometers. Measured are

    d = mean f after - mean f before = f x theta + b + e,   phi = theta + e'        (1)

phi is the integral of the gyroscopes over the gap, less their mean rate in both
stretches. Either theta is 0, or it is random, N(0, TYPICAL_ROTATION^2); and either b is
0, or, with a small probability, it is a jump, N(0, TYPICAL_JUMP^2). By Bayes' rule over
these four cases

    P(as before) = sum over b of P(b) N(d, phi | theta = 0, b) / sum over all       (2)

Means over T s, g s apart, of noise of the Allan deviation a(T) differ by

    var e = 2 a^2 B(1 + g/T),                                                       (3)
    B(r) = ((r+1)^2 ln(r+1) + (r-1)^2 ln(r-1) - 2 r^2 ln r) / (4 ln 2)

and by v (T + g), v their common slope, which counts as an uncertainty of its own size.
T is chosen so that the sum is least. B is that of flicker, and too large for white
noise. The integral over the n samples in the gap has the errors of their fast part
(noise, or a swing that they do not resolve) and of the mean rate in both stretches:

    var e' = n dt^2 q + g^2 (var e_w / 4 + d_w^2 / 12) + (s^2 / 2)^2,               (4)
    q = mean of (k-th differences of w)^2 / (2k over k),   k = 4 if there are so many

q is the variance of white noise. Of a swing at a fifth of the sampling rate it contains
a fortieth, since a swing that is sampled often enough is integrated correctly. s is the
largest angle within the gap: sums of rates are angles to first order only.
Device axes; m/s^2, rad/s, rad, s. Sources: Barnes 1969, NBS TN 375 (bias function B2);
IEEE 952 (Allan variance).
"""

from __future__ import annotations

from math import comb, log

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.running_integral import running_integral
from fieldcal.core.samples import Array, Block
from fieldcal.windows.cells import (
    CELL,
    CellTable,
    fill_with_previous,
)
from fieldcal.windows.quiet import LENGTH_RATIO, LEVELS, estimate_quiet_noise

TYPICAL_ROTATION = 5e-3
"""Typical lasting rotation by a bump, rad about each axis: some tenths of a degree, as
feet slip and cushions give way."""

PRIOR_UNMOVED = 0.5
"""Prior probability that a bump leaves the attitude unchanged."""

JUMP_PROBABILITY, TYPICAL_JUMP = 0.01, 5e-2
"""Prior probability that a bump makes the biases jump, and the typical jump, m/s^2; as
in the effect `bias_step`."""

LARGEST_ANGLE = 0.1
"""Largest angle within the gap, and of the force from before to after it, rad; beyond
it the device was carried elsewhere, whatever the gyroscopes show."""

EXTRA_LEVELS = 2
"""Noise levels beyond the usual ones, where they are measured: up to 51 s."""

SLOPE_STRETCH = 4
"""Length of the stretch that gives the slope, as a multiple of T."""

DIFFERENCE_ORDER = 4
"""Order of the differences of rates that give their fast part."""


def probability_unmoved(
    before: CellTable, way: Block, after: CellTable, gap: tuple[float, float]
) -> float:
    """Probability of an unchanged attitude, (2); 0 if the device was carried elsewhere.

    Parameters
    ----------
    before, after : cells of both stretches, about one origin
    way : samples from before the gap to behind it
    gap : its start and end, s of device time

    """
    level, change, spread = _compare_means(before, after, gap[1] - gap[0])
    inside = way.between(*gap)
    turned, unsure, most = _turn_in_gap(inside, level[3:], change[3:], spread[3:])
    if np.isnan(most):  # without gyroscopes, the angle of gravity in device axes
        most = _largest_angle(inside, level[:3])
    # a turn that is not recorded shows in the force alone
    force_angle = float(np.linalg.norm(change[:3]) / np.linalg.norm(level[:3]))
    if not np.fmax(most, force_angle) < LARGEST_ANGLE:
        return 0.0
    change_and_turn = np.concatenate([change[:3], turned])
    noise = np.concatenate([spread[:3], unsure])
    known = np.isfinite(change_and_turn) & np.isfinite(noise) & (noise > 0)
    known[:3] &= known[:3].all()
    if not known[0] and not known[3:].all():
        return 0.0
    lean = np.vstack([_cross_matrix(np.nan_to_num(level[:3])), np.eye(3)])  # (1)
    jump = np.diag([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]) * TYPICAL_JUMP**2
    logs = np.array(
        [
            np.log(p * q)
            + _log_density(change_and_turn, np.diag(noise) + turn + step, known)
            for p, turn in (
                (PRIOR_UNMOVED, np.zeros((6, 6))),
                (1 - PRIOR_UNMOVED, TYPICAL_ROTATION**2 * lean @ lean.T),
            )
            for q, step in (
                (1 - JUMP_PROBABILITY, np.zeros((6, 6))),
                (JUMP_PROBABILITY, jump),
            )
        ]
    )
    weight = np.exp(logs - logs.max())
    return float(weight[:2].sum() / weight.sum())  # (2)


def _compare_means(
    before: CellTable, after: CellTable, gap: float
) -> tuple[Array, Array, Array]:
    """Mean beside a gap of `gap` s, its change, and the variance of the change.

    (6,) each, SI. The means of each channel are over the time with the least
    variance (3).
    """
    left, right = (
        fill_with_previous(before.means)[::-1],
        fill_with_previous(after.means),
    )
    fewest = min(len(left), len(right))
    rows = np.vstack([left[::-1], right])
    longer = EXTRA_LEVELS * (
        len(rows) > LENGTH_RATIO * 2 ** (LEVELS + EXTRA_LEVELS - 1)
    )
    allan = estimate_quiet_noise(rows, levels=LEVELS + longer).allan
    comparisons = []
    for k, a in enumerate(allan[: fewest.bit_length()]):
        n = 2**k
        distance = gap + n * CELL  # of the middles of both means
        drift = (
            _slope(right[: SLOPE_STRETCH * n]) - _slope(left[: SLOPE_STRETCH * n])
        ) / 2
        spread = 2 * a**2 * flicker_bias_function(1 + gap / (n * CELL))  # (3)
        means = left[:n].mean(axis=0), right[:n].mean(axis=0)
        comparisons.append((*means, spread + (drift * distance) ** 2))
    table = np.array(comparisons)
    best = np.argmin(table[:, 2], axis=0)
    mean, other, spread = table[best, :, np.arange(6)].T
    coarse = np.maximum(before.rounding, after.rounding)
    return before.origin + (mean + other) / 2, other - mean, spread + coarse**2 / 6


def _slope(means: Array) -> Array:
    """Slope of a line through means of cells (m, 6), away from the gap, SI/s."""
    x = (np.arange(len(means)) - (len(means) - 1) / 2) * CELL
    slope: Array = x @ means / (x @ x)
    return slope


def flicker_bias_function(r: float) -> float:
    """B of (3), r > 1.

    >>> round(flicker_bias_function(2.0), 3)
    1.566
    """
    terms = (r + 1) ** 2 * log(r + 1) - 2 * r**2 * log(r)
    return (terms + (r - 1) ** 2 * log(max(r - 1, 1e-9))) / (4 * log(2))


def _turn_in_gap(
    way: Block, level: Array, change: Array, spread: Array
) -> tuple[Array, Array, float]:
    """Rotation in the gap by the gyroscopes, (3,) rad, its variance, and its maximum.

    nan if the gyroscopes are missing.

    Parameters
    ----------
    way : samples of the gap
    level, change, spread : of the rates beside it, as `_compare_means` returns them

    """
    nothing = np.full(3, np.nan)
    if len(way) < 2 or not np.isfinite(way.gyr).all():
        return nothing, nothing, np.nan
    rate = way.gyr - level
    angle = running_integral(way.t, rate)
    most = float(np.linalg.norm(angle, axis=1).max())
    order = min(DIFFERENCE_ORDER, len(rate) - 1)
    quick = np.diff(rate, order, axis=0) ** 2 / comb(2 * order, order)
    drawn = len(rate) * float(np.median(np.diff(way.t))) ** 2 * quick.mean(axis=0)
    bias = float(way.t[-1] - way.t[0]) ** 2 * (spread / 4 + change**2 / 12)
    return angle[-1], drawn + bias + (most**2 / 2) ** 2, most  # (4)


def _largest_angle(way: Block, force: Array) -> float:
    """Largest angle from `force` within the gap, rad, by means over cells."""
    whole = way.acc[np.isfinite(way.acc).all(axis=1)]
    if not len(whole):
        return np.nan
    many = max(1, round(CELL * len(way) / float(np.ptp(way.t) or CELL)))
    parts = np.array_split(whole, max(1, len(whole) // many))
    off = np.array([part.mean(axis=0) - force for part in parts])
    return float(np.linalg.norm(off, axis=1).max() / np.linalg.norm(force))


def _cross_matrix(v: Array) -> Array:
    """Matrix [v]x with v x u = [v]x u."""
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _log_density(
    difference: Array, covariance: Array, known: NDArray[np.bool_]
) -> float:
    """Log normal density of those elements of `difference` that are `known`."""
    part = covariance[np.ix_(known, known)]
    root = np.linalg.cholesky(part)
    white = np.linalg.solve(root, difference[known])
    return float(-np.log(root.diagonal()).sum() - white @ white / 2)
