"""Low-passes of first and of second order, and how their outputs change with them.

A sensor with a time constant tau puts out for an input u

    y(t) = int_0^inf u(t - tau a) exp(-a) da                     first order       (1)
    y(t) = int_0^inf u(t - sqrt(2) tau a) 2 exp(-a) sin(a) da    second order      (2)

which are, with the operator D = d/dt, 1 / (1 + tau D) and the Butterworth low-pass
1 / (1 + sqrt(2) tau D + tau^2 D^2) with the cut-off 1 / (2 pi tau), Hz. A negative tau
is the inverse of that of |tau|: the reference has been through it,

    y = (1 + |tau| D) u,    y = (1 + sqrt(2) |tau| D + tau^2 D^2) u                 (3)

The integral (1) is evaluated by Gauss-Laguerre quadrature, exact for polynomials of
degree 2 NODES - 1, and (2) by Gauss-Legendre quadrature up to a = PAST. For either
sign, with F the low-pass of |tau|,

    dy / dtau = -D F y                                                             (4)
    dy / dtau = -(sqrt(2) D + 2 |tau| D^2) F y = sqrt(2) D F y - 2 (y - F y) / |tau| (5)

Units: s; values in the input's. Source: first-order lag; S. Butterworth, On the theory
of filter amplifiers, 1930; Abramowitz and Stegun 25.4.45 and 25.4.29.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from fieldcal.core.samples import Array

NODES = 5
"""Of the sum in place of (1)."""

PAST, POINTS = 14.0, 20
"""Where (2) ends, with exp(-14) left out, and points of the sum in place of it, which
is right to 3e-6 up to twice the cut-off."""

ROOT2 = np.sqrt(2)


def first_order(spline: CubicSpline, tau: float) -> Array:
    """Values (n, k) of a spline of k channels at its knots, after (1) or inverse."""
    if tau < 0:
        early: Array = spline(spline.x) - tau * spline(spline.x, 1)  # (3)
        return early
    ages, weights = np.polynomial.laguerre.laggauss(NODES)
    return _late(spline, tau * ages, weights)  # (1)


def second_order(spline: CubicSpline, tau: float) -> Array:
    """Values (n, k) of a spline of k channels at its knots, after (2) or inverse."""
    if tau < 0:
        t = spline.x
        change = spline(t, 1)  # right to h^4 at the knots, its own bend only to h^2
        bend = CubicSpline(t, change)(t, 1)
        early: Array = spline(t) - ROOT2 * tau * change + tau**2 * bend  # (3)
        return early
    place, weights = np.polynomial.legendre.leggauss(POINTS)
    ages = (place + 1) * PAST / 2
    weights = weights * np.exp(-ages) * np.sin(ages)
    return _late(spline, ROOT2 * tau * ages, weights / weights.sum())  # (2)


def first_order_slope(spline: CubicSpline, tau: float) -> Array:
    """By how much less comes out for each second of tau, of an output (n, k), (4)."""
    slower = CubicSpline(spline.x, first_order(spline, abs(tau)))
    out: Array = slower(spline.x, 1)
    return out


def second_order_slope(spline: CubicSpline, tau: float) -> Array:
    """The same of a low-pass of second order, (5); tau is not 0."""
    t, tau = spline.x, abs(tau)
    slower = CubicSpline(t, second_order(spline, tau))
    out: Array = 2 * (spline(t) - slower(t)) / tau - ROOT2 * slower(t, 1)
    return out


def _late(spline: CubicSpline, late: Array, weights: Array) -> Array:
    """Sum of what a spline was some times ago, s, with weights."""
    t = spline.x
    out: Array = sum(
        weight * spline(np.maximum(t - ago, t[0]))
        for ago, weight in zip(late, weights, strict=True)
    )
    return out
