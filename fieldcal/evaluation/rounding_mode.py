"""Estimates how the accelerometers round if the device does not state it.

Values on a grid of step q, m/s^2, are right on average if they are rounded to the
nearest. If they are cut toward zero, as by a conversion to integers, their size is q /
2 too small on average. If they are rounded down, as by a shift of bits, they are q / 2
too small. A mean does not show which is the case, but the value zero does: if values
are cut toward zero, all between -q and q become zero, an interval twice as wide as that
of any other value. An output that passes from -2 q to 2 q or back without resting is
zero for n0 samples, and has each neighbouring value for n1 samples on average, with

    ln (n0 / n1) ~ N(ln 2, s^2) if cut, N(0, s^2) if not,   s^2 = S^2 + 2 / n1     (1)

over all passes of all outputs. S is the scatter by the changing rate of a turn. The
device has one firmware, so all outputs have the same mode.

The error of values rounded down is added to the variance of the biases. That of values
cut toward zero depends on the signs of the means, and is in the model
(`solve.parameter_set`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.calibration import Calibration
from fieldcal.core.probability import probability_of_log_odds
from fieldcal.core.samples import Array, Grain
from fieldcal.physics.recording import grids_of
from fieldcal.session.folder import Session

CUT_CHANCE, DOWN_CHANCE = 0.3, 0.1
"""Prior probability that values were cut toward zero, and rounded down."""

UNSTEADY = 0.3
"""S of (1), ln: scatter of the times in which a turn passes neighbouring values."""

MAX_DWELL_RATIO = 2.0
"""Largest ratio of the times at the two neighbours of zero. With a larger one the
device probably rested there, which is no pass."""

PASSED = 2
"""Fewest samples of each neighbour in a pass."""


@dataclass(frozen=True, slots=True)
class RoundingMode:
    """Uncertainty of the rounding of the accelerometers.

    Attributes
    ----------
    step : (3,) m/s^2; 0 if there is none, or if its rounding is known
    cut_probability : probability that values were cut toward zero

    """

    step: Array
    cut_probability: float

    @property
    def cut_sigma(self) -> Array:
        """Error in size of values that may be cut toward zero, 1 sigma, (3,) m/s^2."""
        out: Array = np.sqrt(self.cut_probability) * self.step / 2
        return out

    @property
    def round_down_sigma(self) -> Array:
        """Error of values that may be rounded down, 1 sigma, (3,) m/s^2."""
        chance = DOWN_CHANCE / (1 - CUT_CHANCE) * (1 - self.cut_probability)
        out: Array = np.sqrt(chance) * self.step / 2
        return out

    def variance_near_zero(self, mean: Array) -> Array:
        """Added variance of means near zero, where values become zero, (n, 3)."""
        size = np.abs(np.nan_to_num(mean))
        out: Array = np.where(
            size < self.step / 2, self.cut_probability * self.step**2 / 3, 0.0
        )
        return out


def rounding_mode(session: Session, grain: Grain) -> RoundingMode:
    """Estimate the rounding from samples; `grain` is the rounding that is known."""
    acc = session.block.acc
    seen = np.zeros(3) if session.about.means_only else grids_of(session.block)[:3]
    step = np.where(grain.step[:3] > 0, 0.0, seen)
    passes = [
        counts
        for values, q in zip(acc.T, step, strict=True)
        if q > 0
        for counts in zero_crossings(
            np.rint(values[np.isfinite(values)] / q).astype(np.intp)
        )
    ]
    return RoundingMode(step, cut_probability(passes))


def with_rounding_uncertainty(found: Calibration, mode: RoundingMode) -> Calibration:
    """Add the error of values rounded down to the covariance of the biases."""
    covariance = found.covariance.copy()
    for row, name in enumerate(found.names):
        group, _, axis = name.partition(".")
        if group == "acc_bias":
            covariance[row, row] += mode.round_down_sigma["xyz".index(axis)] ** 2
    return replace(found, covariance=covariance)


def cut_probability(passes: list[tuple[int, float]]) -> float:
    """Probability that values were cut toward zero, from (n0, n1) of passes, (1).

    >>> round(cut_probability([]), 3)
    0.3
    >>> cut_probability([(80, 40.0)] * 4) > 0.99
    True
    >>> cut_probability([(40, 40.0)] * 4) < 0.01
    True
    """
    log_odds = float(np.log(CUT_CHANCE / (1 - CUT_CHANCE)))
    for zero, neighbour in passes:
        variance = UNSTEADY**2 + 2 / neighbour
        log_ratio = float(np.log(max(zero, 0.5) / neighbour))
        difference = log_ratio**2 - (log_ratio - np.log(2.0)) ** 2
        log_odds += difference / (2 * variance)
    return float(probability_of_log_odds(log_odds))


def zero_crossings(value: NDArray[np.intp]) -> Iterator[tuple[int, float]]:
    """Numbers n0 and n1 of (1) for each pass through zero of values, in steps."""
    out = np.flatnonzero(np.abs(value) >= 2)
    for first, last in zip(out[:-1].tolist(), out[1:].tolist(), strict=True):
        if (value[first] > 0) == (value[last] > 0) or last == first + 1:
            continue
        between = value[first + 1 : last]
        below, zero, above = (int((between == k).sum()) for k in (-1, 0, 1))
        shorter, longer = sorted((below, above))
        if (
            shorter >= PASSED
            and longer <= MAX_DWELL_RATIO * shorter
            and zero <= 2 * MAX_DWELL_RATIO * longer
        ):
            yield zero, (below + above) / 2
