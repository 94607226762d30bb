"""How a device rounds, where nobody knows, and what it sets to zero.

Values on a grid of steps q are right on average where they are rounded to the nearest;
cut toward zero, as a conversion to integers does, they are q / 2 too small in size;
rounded down, as a shift of bits does, q / 2 too small. A mean of v shows no
difference, but zero does: cut toward zero it is all between -q and q, twice as wide as
any other value. An output that passes from -2 q to 2 q or back without resting rests on
zero for n0 samples and on its neighbours for n1 in the mean, and

    ln (n0 / n1) ~ N(ln 2, s^2) if cut, N(0, s^2) if not,   s^2 = S^2 + 2 / n1     (1)

over all passes of all outputs, where S is how unsteadily a turn passes. The device has
one firmware, so it is one mode for all.

A dead band sets what is smaller than d to zero, d > q: the output is zero often, and
has no other value below d. A mean of less than 2 d is off by d / sqrt(3) or less.

What values that were rounded down are too small by is added to the biases' variance;
what values cut toward zero are hangs on the signs of the means, and is in the model
(`solve.parameter_set`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.calibration import Calibration
from fieldcal.core.chances import of_odds
from fieldcal.core.samples import Array, Grain
from fieldcal.physics.recording import grids_of
from fieldcal.session.folder import Session

CUT, DOWN = 0.3, 0.1
"""Chance that values of unknown rounding were cut toward zero, and rounded down."""

UNSTEADY = 0.3
"""S of (1): how much faster or slower a turn passes one value than the next, ln."""

EVEN = 2.0
"""Times that one neighbour of zero may show for as long as the other: a device that
comes to rest beside zero, or on it, does not pass it."""

PASSED = 2
"""Samples of each neighbour from which a pass counts, and zeros of a dead band."""


@dataclass(frozen=True, slots=True)
class RoundingMode:
    """What is not known of the rounding of the accelerometers.

    Attributes
    ----------
    step : (3,) m/s^2; 0 where there is none, or somebody knows how it is rounded
    cut : probability that values were cut toward zero
    dead : (3,) m/s^2 below which values are zero; 0 where there is no such band

    """

    step: Array
    cut: float
    dead: Array = field(default_factory=lambda: np.zeros(3))

    @property
    def toward_zero(self) -> Array:
        """What values are too small by in size, 1 sigma, (3,) m/s^2."""
        out: Array = np.sqrt(self.cut) * self.step / 2
        return out

    @property
    def down(self) -> Array:
        """What values are too small by, 1 sigma, (3,) m/s^2."""
        chance = DOWN / (1 - CUT) * (1 - self.cut)
        out: Array = np.sqrt(chance) * self.step / 2
        return out

    def around_zero(self, mean: Array) -> Array:
        """Variance of a mean of which values were cut or set to zero, (n, 3)."""
        size = np.abs(np.nan_to_num(mean))
        cut = np.where(size < self.step / 2, self.cut * self.step**2 / 3, 0.0)
        out: Array = cut + np.where(size < 2 * self.dead, self.dead**2 / 3, 0.0)
        return out


def rounding_mode(session: Session, grain: Grain) -> RoundingMode:
    """What the samples of a session tell of it; `grain` is what is known."""
    acc = session.block.acc
    seen = np.zeros(3) if session.about.means_only else grids_of(session.block)[:3]
    step = np.where(grain.step[:3] > 0, 0.0, seen)
    shown = [
        ratio
        for values, q in zip(acc.T, step, strict=True)
        if q > 0
        for ratio in passes(np.rint(values[np.isfinite(values)] / q).astype(np.intp))
    ]
    least = np.maximum(seen, grain.step[:3])
    return RoundingMode(step, cut_toward_zero(shown), dead_bands(acc, least))


def dead_bands(acc: Array, step: Array) -> Array:
    """What is the smallest value but zero of outputs with a dead band, else 0, (3,).

    Zero on all axes is no output: such samples were lost.
    """
    some = np.isfinite(acc).all(axis=1) & (acc != 0).any(axis=1)
    size = np.abs(acc[some])
    zeros = np.count_nonzero(size == 0, axis=0)
    least = np.where(size > 0, size, np.inf).min(axis=0, initial=np.inf)
    there = (zeros >= PASSED) & np.isfinite(least) & (least > 1.5 * step)
    out: Array = np.where(there, least, 0.0)
    return out


def with_rounding(found: Calibration, mode: RoundingMode) -> Calibration:
    """The calibration with what values rounded down may take off its biases."""
    covariance = found.covariance.copy()
    for row, name in enumerate(found.names):
        group, _, axis = name.partition(".")
        if group == "acc_bias":
            covariance[row, row] += mode.down["xyz".index(axis)] ** 2
    return replace(found, covariance=covariance)


def cut_toward_zero(shown: list[tuple[int, float]]) -> float:
    """Probability that values were cut, by (n0, n1) of passes, (1).

    >>> round(cut_toward_zero([]), 3)
    0.3
    >>> cut_toward_zero([(80, 40.0)] * 4) > 0.99
    True
    >>> cut_toward_zero([(40, 40.0)] * 4) < 0.01
    True
    """
    log_odds = float(np.log(CUT / (1 - CUT)))
    for zero, beside in shown:
        variance = UNSTEADY**2 + 2 / beside
        off = float(np.log(max(zero, 0.5) / beside))
        log_odds += (off**2 - (off - np.log(2.0)) ** 2) / (2 * variance)
    return float(of_odds(log_odds))


def passes(value: NDArray[np.intp]) -> Iterator[tuple[int, float]]:
    """How long values, in steps, are zero, and one beside it, in each pass, (1)."""
    out = np.flatnonzero(np.abs(value) >= 2)
    for first, last in zip(out[:-1].tolist(), out[1:].tolist(), strict=True):
        if (value[first] > 0) == (value[last] > 0) or last == first + 1:
            continue
        between = value[first + 1 : last]
        below, zero, above = (int((between == k).sum()) for k in (-1, 0, 1))
        less, more = sorted((below, above))
        if less >= PASSED and more <= EVEN * less and zero <= 2 * EVEN * more:
            yield zero, (below + above) / 2
