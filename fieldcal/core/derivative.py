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
    gap, slope = np.empty(len(t)), np.empty(values.shape)
    for change, course in ((gap, t), (slope, values)):
        np.subtract(course[2:], course[:-2], out=change[1:-1])
        change[0], change[-1] = course[1] - course[0], course[-1] - course[-2]
    slope /= gap.reshape(-1, *[1] * (values.ndim - 1))
    return slope
