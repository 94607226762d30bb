"""Rates that are zero in every sample at rest, as they are where steps are coarse.

An output whose noise is much smaller than its step reads zero for any bias within half
a step, and the windows tell nothing more. Turns do: there the rounding averages out. A
device that subtracts its bias leaves none in the turns either. With the bias b and its
error s from all rows, its likelihood ratio to a gyroscope that keeps a bias of spread
s_b is, over the axes,

    B = prod N(b; 0, s^2) / prod N(b; 0, s^2 + s_b^2)                              (1)
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.core.samples import Array, Block, Mask


def zero_rates(held: Sequence[Block]) -> Mask:
    """Gyroscopes that read zero in all samples of blocks at rest, (3,)."""
    zero: Mask = np.all([~one.gyr.any(axis=0) for one in held], axis=0)
    return zero


def log_odds_of_no_bias(bias: Array, sigma: Array, spread: float) -> float:
    """Log of B (1) for biases (a,) with errors (a,), rad/s; unknown ones do not count.

    >>> round(log_odds_of_no_bias(np.zeros(1), np.ones(1), 3.0), 3)  # ln sqrt(10)
    1.151
    """
    known = np.isfinite(bias) & (sigma > 0) & np.isfinite(sigma)
    square, var = bias[known] ** 2, sigma[known] ** 2
    wide = var + spread**2
    return float(0.5 * np.sum(np.log(wide / var) - square / var + square / wide))
