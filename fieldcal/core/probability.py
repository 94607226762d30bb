"""Probabilities of a chi-square sum and of log odds; the scale of a median deviation.

    Q(chi2, 2 m) = e^-x sum_{i=0}^{m-1} x^i / i!                                    (1)
    Q(chi2, 2 m + 1) = erfc(sqrt x) + e^-x sum_{i=1}^{m} x^(i-1/2) / Gamma(i + 1/2)  (2)

with x = chi2 / 2. Source: M. Abramowitz and I. Stegun, Handbook of Mathematical
Functions, 26.4.4 and 26.4.5. Degrees of freedom are whole numbers. Importing a
library's function for any degrees of freedom would take longer than a calibration.
"""

from __future__ import annotations

from math import erfc, isinf, lgamma, log, sqrt

import numpy as np
from numpy.typing import ArrayLike

from fieldcal.core.samples import Array

MAD_TO_SIGMA = 1.4826
"""Standard deviation of a normal variable over its median absolute deviation."""


def chi2_tail(chi2: float, dof: int) -> float:
    """Probability of a chi-square at least as large as `chi2`.

    >>> [round(chi2_tail(x, k), 6) for x, k in ((3.84, 1), (5.99, 2), (7.81, 3))]
    [0.050044, 0.050037, 0.050106]
    """
    if chi2 <= 0:
        return 1.0
    x, (m, odd) = chi2 / 2, divmod(dof, 2)
    start = erfc(sqrt(x)) if odd else 0.0
    if not m or isinf(x):
        return start
    power = np.arange(m) + 0.5 * odd
    gamma = lgamma(power[0] + 1) + np.cumsum([0.0, *np.log(power[1:])])
    return start + float(np.exp(power * log(x) - x - gamma).sum())


def probability_of_log_odds(log_odds: ArrayLike) -> Array:
    """Probability for each natural logarithm of odds; without overflow.

    >>> probability_of_log_odds([-1e4, 0.0, 1e4]).tolist()
    [0.0, 0.5, 1.0]
    """
    out: Array = np.exp(-np.logaddexp(0.0, -np.asarray(log_odds, dtype=float)))
    return out
