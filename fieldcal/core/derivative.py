"""Derivative of a course by time, as well behaved at uneven times as at even ones.

    x'_k = (x_k+1 - x_k-1) / (t_k+1 - t_k-1)                                      (1)

and from one step at both ends. For even times the error is of second order. Weights
that keep this order at uneven times divide by each single step: where two samples have
nearly the same time, as those of one batch, they multiply the noise, and a slope times
the step beside it is not bounded. By (1) it is.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array


def derivative(t: Array, values: Array) -> Array:
    """Derivative (n, ...) of values (n, ...) at instants t (n,), n >= 2, ascending.

    >>> derivative(np.array([0.0, 1.0, 3.0]), np.array([0.0, 2.0, 6.0])).tolist()
    [2.0, 2.0, 2.0]
    """
    at = np.arange(len(t))
    before, after = np.maximum(at - 1, 0), np.minimum(at + 1, len(t) - 1)
    gap = (t[after] - t[before]).reshape(-1, *[1] * (values.ndim - 1))
    slope: Array = (values[after] - values[before]) / gap
    return slope
