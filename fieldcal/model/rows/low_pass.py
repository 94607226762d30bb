"""Low-passes of first and of second order, and how their outputs change with them.

With the operator D = d/dt, a time constant tau and an input u these are

    y = 1 / (1 + tau D) u                                        first order       (1)
    y = 1 / (1 + sqrt(2) tau D + tau^2 D^2) u                    second order      (2)

and (2) is the Butterworth low-pass with the cut-off 1 / (2 pi tau), Hz. A negative tau
is the inverse of that of |tau|: the reference has been through it,

    y = (1 + |tau| D) u,    y = (1 + sqrt(2) |tau| D + tau^2 D^2) u                 (3)

Both follow from a pole p, -1 / tau or (-1 + i) / (sqrt(2) tau), and

    z' = p z + u,    y = z / tau  or  y = sqrt(2) / tau Im z                         (4)

which is solved from one even instant to the next, exactly for a cubic u. For either
sign, with F the low-pass of |tau|,

    dy / dtau = -D F y = -(y - F y) / |tau|                                          (5)
    dy / dtau = -(sqrt(2) D + 2 |tau| D^2) F y = sqrt(2) D F y - 2 (y - F y) / |tau| (6)

Units: s; values in the input's. Source: first-order lag; S. Butterworth, On the theory
of filter amplifiers, 1930.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from fieldcal.core.samples import Array

ROOT2 = np.sqrt(2)

RESTART_INTERVALS = 3.5
"""Intervals between knots from which the input is taken up anew, at rest."""

QUADRATURE_NODES, FORGOTTEN_EXPONENT = 48, 40.0
"""Of the integral of a cubic from one instant to the next, times the exponential, and
the exponent from which on that has nothing left."""


def first_order(spline: CubicSpline, tau: float) -> CubicSpline:
    """A spline of k channels after low-pass (1), or after its inverse."""
    even = _even_knots(spline)
    t, u = even.x, even(even.x)
    if tau < 0:
        return CubicSpline(t, u - tau * even(t, 1))  # (3)
    return CubicSpline(t, _filter_state(even, u, -1 / tau) / tau)  # (4)


def second_order(spline: CubicSpline, tau: float) -> CubicSpline:
    """A spline of k channels after low-pass (2), or after its inverse."""
    even = _even_knots(spline)
    t, u = even.x, even(even.x)
    if tau < 0:
        change = even(t, 1)  # right to h^4 at the knots, its own bend only to h^2
        bend = CubicSpline(t, change)(t, 1)
        return CubicSpline(t, u - ROOT2 * tau * change + tau**2 * bend)  # (3)
    pole = (-1 + 1j) / (ROOT2 * tau)
    return CubicSpline(t, ROOT2 / tau * _filter_state(even, u, pole).imag)  # (4)


def first_order_slope(spline: CubicSpline, tau: float) -> CubicSpline:
    """Decrease of an output per second of tau, (5)."""
    even, tau = _even_knots(spline), abs(tau)
    t, y = even.x, even(even.x)
    return CubicSpline(t, (y - _filter_state(even, y, -1 / tau) / tau) / tau)


def second_order_slope(spline: CubicSpline, tau: float) -> CubicSpline:
    """The same of a low-pass of second order, (6); tau is not 0."""
    even, tau = _even_knots(spline), abs(tau)
    t, y, pole = even.x, even(even.x), (-1 + 1j) / (ROOT2 * tau)
    z = _filter_state(even, y, pole)
    slower, change = ROOT2 / tau * z.imag, ROOT2 / tau * (pole * z).imag
    return CubicSpline(t, 2 * (y - slower) / tau - ROOT2 * change)


def _even_knots(spline: CubicSpline) -> CubicSpline:
    """The spline with evenly spaced knots, except for pauses."""
    t = spline.x
    step = float(np.median(np.diff(t)))
    if np.allclose(np.diff(t), step, rtol=1e-6, atol=0.0):
        return spline
    breaks = np.flatnonzero(np.diff(t) > RESTART_INTERVALS * step) + 1
    even = [
        np.linspace(some[0], some[-1], max(round((some[-1] - some[0]) / step), 1) + 1)
        for some in np.split(t, breaks)
        if some[-1] > some[0]
    ]
    knots = np.concatenate(even)
    return CubicSpline(knots, spline(knots))


def _filter_state(even: CubicSpline, u: Array, pole: complex) -> Any:
    """Z of (4) at the knots, (n, k), from rest after every pause."""
    t = even.x
    change = even(t, 1)
    out = np.empty(u.shape, dtype=np.result_type(pole, float))
    steps = np.diff(t)
    pauses = np.flatnonzero(steps > RESTART_INTERVALS * np.median(steps)) + 1
    for some in np.split(np.arange(len(t)), pauses):
        step = float(np.mean(np.diff(t[some]))) if len(some) > 1 else 0.0
        out[some] = _from_rest(u[some], change[some], step, pole)
    return out


def _from_rest(u: Array, change: Array, step: float, pole: complex) -> Any:
    """Z of (4) at even instants of an input with a derivative, (n, k)."""
    keep = np.exp(pole * step)
    place, weight = np.polynomial.legendre.leggauss(QUADRATURE_NODES)
    part = min(1.0, FORGOTTEN_EXPONENT / max(-pole.real * step, 1e-300))
    x = 1 - (1 - place) / 2 * part
    weight = weight / 2 * part * step * np.exp(pole * step * (1 - x))
    # Hermite's cubics: values and derivatives at both ends
    last = weight @ ((1 + 2 * x) * (1 - x) ** 2)
    ahead = weight @ (x**2 * (3 - 2 * x))
    last_change = step * (weight @ (x * (1 - x) ** 2))
    change_ahead = step * (weight @ (x**2 * (x - 1)))
    drive = np.empty(u.shape, dtype=np.result_type(pole, float))
    drive[0] = -u[0] / pole
    drive[1:] = last * u[:-1] + ahead * u[1:]
    drive[1:] += last_change * change[:-1] + change_ahead * change[1:]
    return lfilter([1.0], [1.0, -keep], drive, axis=0)
