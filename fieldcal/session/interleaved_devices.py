"""Samples of two devices by turns that differ by less than their noise.

In no window alone does a sample tell which device it is of. But the places of a period
in which the second one sends are the same throughout a window, so their means differ,
and in each window i by

    a_i = b_2 - b_1 + (M_2 - M_1) f_i,   w_i = c_2 - c_1 + (G_2 - G_1) f_i         (1)

with biases b and c, the matrices M of scale factors and mounting, the g-sensitivities G
and the force f_i. Whatever else one device does in every k-th sample (another task of
its program, an idle tone of a converter, mains of a multiple of the rate) does not grow
with the force on it. Which place is the second device's differs from window to window,
as samples are lost between them; of every other sample either may be the second's,
which is a sign s_i of each window. So there are two devices if at least two outputs
differ beyond chance over all windows, and some signs make (1) explain the differences,
and one difference for all windows does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from fieldcal.core.once import once_per_block
from fieldcal.core.probability import chi2_tail
from fieldcal.core.samples import Array, Block, Mask
from fieldcal.windows.interleaving import (
    MOST_SAMPLES,
    PERIODS,
    PIECES,
    OnePlace,
    RestOutputs,
    one_place_of_period,
)

CHANCE = 1e-6
"""Probability that noise does what is taken for two devices, in each of three tests."""

LEAST_OUTPUTS = 2
"""Outputs that differ: a device has its errors in all."""

LEAST_STEPS = 1.0
"""Difference in steps of an output that dither by half a step to both sides makes."""

SURELY = 5.0
"""Standard errors by which a difference is larger than that."""

LEFT_BESIDE = 0.2
"""Root of the share that (1) may leave of the squares which a constant leaves: forces
are means of both devices over a window, with all errors that they have."""

KNOWN_TO = 0.02
"""Error of each difference as a share of those of its output: how many samples arrive
in the wrong order is a little other in each window."""

LARGE_PER_ROW = 3.0
"""Square, in its variance, that may be left of each difference that is not fitted, and
times chance is exceeded: errors are known to a seventh of themselves."""

MOST_STARTS = 8
"""Windows of which all signs are tried; the others' follow one by one."""

SMALL_TURN = 0.02
"""Least part of a course of the forces over the windows that (1) is asked about."""


def find_interleaved_devices(
    block: Block, windows: Sequence[tuple[float, float] | None]
) -> OnePlace | None:
    """What two devices differ by in one window; None if it is one.

    Parameters
    ----------
    block : samples of the session
    windows : begin and end of each, s of device time; None where none was taken

    """
    ends = [np.searchsorted(block.t, w) for w in windows if w is not None]
    return _found_between(block, tuple((int(a), int(b)) for a, b in ends))


@once_per_block
def _found_between(block: Block, ends: tuple[tuple[int, int], ...]) -> OnePlace | None:
    """What two devices differ by in one of the windows; None if it is one device.

    `ends` are the first sample of each, and the one behind its last.
    """
    parts = [part for a, b in ends if _has_force(part := block[a:b])]
    if not parts:
        return None
    rests = [RestOutputs.of(part.six) for part in parts]
    found = {k: [one_place_of_period(rest, k) for rest in rests] for k in PERIODS}
    if not any(map(_may_differ, found.values())):
        return None
    period = max(PERIODS, key=lambda k: _surprise(found[k], k))
    pairs = zip(found[period], parts, strict=True)
    known = [(one, part) for one, part in pairs if one is not None and one.steady]
    if 2 * len(known) <= len(parts):
        return None
    places = [one for one, _ in known]
    differ = _differ(places, period)
    if np.count_nonzero(differ) < LEAST_OUTPUTS:
        return None
    steps = np.min([_steps(part[:MOST_SAMPLES].six) for _, part in known], axis=0)
    if np.count_nonzero(differ & _exceed_dither(places, steps)) < LEAST_OUTPUTS:
        return None
    force = np.array([np.nanmean(part.acc, axis=0) for _, part in known])
    if not _grow_with_force(places, force, period):
        return None
    return max(places, key=lambda one: float((one.t**2).sum()))


def _may_differ(found: Sequence[OnePlace | None]) -> bool:
    """Whether enough outputs would differ beyond chance if errors were known exactly.

    Where they are not, and of several places, differences count for less.
    """
    known = [one.t**2 for one in found if one is not None and one.steady]
    squares = np.sum(known, axis=0) if known else np.zeros(6)
    rare = [chi2_tail(float(square), len(known)) for square in squares]
    return sum(p < CHANCE / (6 * len(PERIODS)) for p in rare) >= LEAST_OUTPUTS


def _has_force(part: Block) -> bool:
    """Whether each accelerometer has a value in a window."""
    return bool(np.isfinite(part.acc).any(axis=0).all())


def _surprise(found: Sequence[OnePlace | None], period: int) -> float:
    """How far all differences exceed noise, as a square."""
    known = [one for one in found if one is not None]
    return float(sum(_squares(one, period).sum() for one in known))


def _squares(one: OnePlace, period: int) -> Array:
    """Squares of standard normal numbers as rare as the differences, (6,).

    As rare as the largest of all places; the two of a period of 2 tell the same.
    """
    from scipy.special import ndtri, stdtr  # a twentieth of a second to import

    rare = (period if period > 2 else 1) * stdtr(PIECES - 1, -np.abs(one.t))
    return np.asarray(ndtri(np.clip(rare, np.finfo(float).tiny, 0.5)) ** 2)


def _differ(found: Sequence[OnePlace], period: int) -> Mask:
    """Which outputs differ beyond chance over all windows, (6,)."""
    from scipy.special import chdtri

    least = chdtri(len(found), CHANCE / (6 * len(PERIODS)))
    squares = np.sum([_squares(one, period) for one in found], axis=0)
    return np.asarray(squares > least)


def _exceed_dither(found: Sequence[OnePlace], steps: Array) -> Mask:
    """Which outputs, with steps (6,), differ by more than dither in some window."""
    clear = [np.abs(one.size) - SURELY * one.error for one in found]
    return np.asarray(np.max(clear, axis=0) > LEAST_STEPS * steps)


def _steps(six: Array) -> Array:
    """Least difference of two values of each output, (6,); 0 of constant ones."""
    values = (np.unique(column[np.isfinite(column)]) for column in six.T)
    return np.array([np.diff(v).min() if len(v) > 1 else 0.0 for v in values])


def _grow_with_force(found: Sequence[OnePlace], force: Array, period: int) -> bool:
    """Whether (1) explains the differences, and a constant does not.

    `force` (w, 3) is the mean in each window.
    """
    from scipy.special import chdtri

    one, size = np.ones((len(force), 1)), np.linalg.norm(force, axis=1).mean()
    steady, freedom = _left(found, one, period)
    left, free = _left(found, np.hstack([one, force / size]), period)
    signs = len(force) if period == 2 else 0
    chance = max(CHANCE * 2.0**-signs, np.finfo(float).tiny)
    if not free or steady <= LARGE_PER_ROW * chdtri(freedom, chance):
        return False
    return left <= LARGE_PER_ROW * free + LEFT_BESIDE**2 * steady


def _left(found: Sequence[OnePlace], design: Array, period: int) -> tuple[float, int]:
    """Squares that columns (w, k) leave of the differences, and their freedom.

    With signs s, the squares are s Q s, of a matrix Q over the windows.
    """
    sizes = np.array([one.size for one in found])
    floor = KNOWN_TO * np.sqrt((sizes**2).mean(axis=0))
    errors = np.hypot([one.error for one in found], floor)
    whole, free = np.zeros((len(found), len(found))), 0
    for size, error in zip(sizes.T, errors.T, strict=True):
        if not np.isfinite(error).any():
            continue
        rows, own = design / error[:, None], size / error
        fit = rows @ np.linalg.pinv(rows, rcond=SMALL_TURN)
        whole += np.outer(own, own) * (np.eye(len(found)) - fit)
        free += len(found) - round(float(np.trace(fit)))
    if period == 2:
        return _least_by_signs(whole), free
    return float(whole.sum()), free


def _least_by_signs(whole: Array) -> float:
    """Least s Q s over signs s of some starts, each improved one sign at a time."""
    count = len(whole)
    order = np.argsort(-whole.diagonal())
    q, least = whole[np.ix_(order, order)], np.inf
    for begin in product((1.0, -1.0), repeat=min(count, MOST_STARTS) - 1):
        s = np.ones(count)
        s[1 : len(begin) + 1] = begin
        while True:
            gain = s * (q @ s) - q.diagonal()  # a quarter of what turning each gains
            if gain.max() <= 1e-9 * q.trace():
                break
            s[gain.argmax()] *= -1
        least = min(least, float(s @ q @ s))
    return least
