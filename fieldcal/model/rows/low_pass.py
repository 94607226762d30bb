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
from scipy.interpolate import CubicSpline, PPoly
from scipy.linalg import get_lapack_funcs

from fieldcal.core.samples import Array
from fieldcal.model import detections, resolutions, tolerances
from fieldcal.model.rows.knots import even_times, hermite_spline

ROOT2 = np.sqrt(2)


def first_order(spline: PPoly, tau: float) -> PPoly:
    """A spline of k channels after low-pass (1), or after its inverse."""
    t, u, change = _even_knots(spline)
    if tau < 0:
        return CubicSpline(t, u - tau * change)  # (3)
    y = _filter_state(t, u, change, -1 / tau) / tau  # (4)
    return hermite_spline(t, y, (u - y) / tau)  # (1)


def second_order(spline: PPoly, tau: float) -> PPoly:
    """A spline of k channels after low-pass (2), or after its inverse."""
    t, u, change = _even_knots(spline)
    if tau < 0:
        # right to h^4 at the knots, the spline's own bend only to h^2
        bend = CubicSpline(t, change)(t, 1)
        return CubicSpline(t, u - ROOT2 * tau * change + tau**2 * bend)  # (3)
    return hermite_spline(t, *_butterworth(t, u, change, tau))


def first_order_slope(spline: PPoly, tau: float) -> PPoly:
    """Decrease of an output per second of tau, (5)."""
    t, y, change = _even_knots(spline)
    tau = abs(tau)
    slower = _filter_state(t, y, change, -1 / tau) / tau
    less = (y - slower) / tau  # (5)
    return hermite_spline(t, less, (change - less) / tau)


def second_order_slope(spline: PPoly, tau: float) -> PPoly:
    """The same of a low-pass of second order, (6); tau is not 0."""
    t, y, change = _even_knots(spline)
    tau = abs(tau)
    slower, drift = _butterworth(t, y, change, tau)
    less = 2 * (y - slower) / tau - ROOT2 * drift  # (6)
    bend = ((y - slower) / tau - ROOT2 * drift) / tau  # (2)
    return hermite_spline(t, less, 2 * (change - drift) / tau - ROOT2 * bend)


def _butterworth(t: Array, u: Array, change: Array, tau: float) -> tuple[Array, Array]:
    """Output of (2) at even knots, and its derivative, (n, k)."""
    pole = (-1 + 1j) / (ROOT2 * tau)
    z = _filter_state(t, u, change, pole)
    return ROOT2 / tau * z.imag, ROOT2 / tau * (pole * z).imag  # (4)


def _even_knots(spline: PPoly) -> tuple[Array, Array, Array]:
    """Knots, even except for pauses, with the spline's values and derivatives."""
    t = spline.x
    step = float(np.median(np.diff(t)))
    if np.allclose(np.diff(t), step, rtol=1e-6, atol=0.0):
        last = t[-1:]
        return (
            t,
            np.concatenate([spline.c[-1], spline(last)]),
            np.concatenate([spline.c[-2], spline(last, 1)]),
        )
    knots = even_times(t, step)
    values = spline(knots)
    return knots, values, CubicSpline(knots, values)(knots, 1)


def _filter_state(t: Array, u: Array, change: Array, pole: complex) -> Any:
    """Z of (4) at the knots, (n, k), from rest after every pause."""
    out = np.empty(u.shape, dtype=np.result_type(pole, float))
    steps = np.diff(t)
    pauses = np.flatnonzero(steps > detections.PAUSE_INTERVALS * np.median(steps)) + 1
    for some in np.split(np.arange(len(t)), pauses):
        step = float(np.mean(np.diff(t[some]))) if len(some) > 1 else 0.0
        out[some] = _from_rest(u[some], change[some], step, pole)
    return out


def _from_rest(u: Array, change: Array, step: float, pole: complex) -> Any:
    """Z of (4) at even instants of an input with a derivative, (n, k)."""
    keep = np.exp(pole * step)
    place, weight = np.polynomial.legendre.leggauss(resolutions.QUADRATURE_NODES)
    part = min(1.0, tolerances.FORGOTTEN_EXPONENT / max(-pole.real * step, 1e-300))
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
    # z[n] - keep z[n - 1] = drive[n]; scipy.signal has this too, but loads for 0.3 s
    band = np.stack([np.ones_like(drive[:, 0]), np.full_like(drive[:, 0], -keep)])
    (solve_band,) = get_lapack_funcs(("tbtrs",), (band, drive))
    state, _ = solve_band(band, drive, uplo="L")
    return state
