"""Knots of cubics: even ones, Hermite's cubics between them, and splines of samples.

Where values and derivatives are both known, no system of equations has to be solved for
the cubics, and they are made in a fraction of the time of a spline's.

A cubic spline through samples loses some of what is quick: at f, of samples at a rate
F, up to (f / (F - f))^4 of it, by how far an instant is from the samples, which looks
like a low-pass. Where samples are even, more are put between them first, by the series
of Whittaker (C. Shannon 1949) with a window.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline, PPoly
from scipy.signal import firwin, resample_poly

from fieldcal.core.samples import Array
from fieldcal.model import detections, resolutions, tolerances


def even_times(t: Array, step: float) -> Array:
    """Instants from the first of some stamps to the last, even except for pauses.

    Parameters
    ----------
    t : (n,) s, increasing
    step : s from one instant to the next, as nearly as the pieces between pauses allow

    """
    breaks = np.flatnonzero(np.diff(t) > detections.PAUSE_INTERVALS * step) + 1
    even = [
        np.linspace(some[0], some[-1], max(round((some[-1] - some[0]) / step), 1) + 1)
        for some in np.split(t, breaks)
        if some[-1] > some[0]
    ]
    return np.concatenate(even)


def hermite_spline(t: Array, values: Array, change: Array) -> PPoly:
    """Cubics with values and derivatives (n, k) at increasing knots t (n,)."""
    step = np.diff(t)[:, None]
    rise = np.diff(values, axis=0) / step
    out = np.empty((4, len(t) - 1, values.shape[1]))
    out[0] = (change[:-1] + change[1:] - 2 * rise) / step**2
    out[1] = (3 * rise - 2 * change[:-1] - change[1:]) / step
    out[2], out[3] = change[:-1], values[:-1]
    return PPoly.construct_fast(out, t)


def spline_through(t: Array, values: Array) -> PPoly:
    """Cubic spline through samples (n, k) at t (n,), s, that keeps what is quick."""
    even, step = np.linspace(t[0], t[-1], len(t)), float(np.median(np.diff(t)))
    times = int(np.ceil(resolutions.KNOTS_HZ * step))
    if times == 1 or np.abs(t - even).max() > tolerances.UNEVEN_SHARE * step:
        return CubicSpline(t, values)
    reach = min(resolutions.SERIES_REACH, len(t) - 1)
    series = firwin(2 * reach * times + 1, 1 / times, window=resolutions.SERIES_WINDOW)
    phase = np.arange(len(series)) % times
    series /= times * np.bincount(phase, series)[phase]  # a constant stays one
    every = odd_extension(values, reach, reach)
    fine = resample_poly(every, times, 1, window=series, padtype="line")
    count = (len(t) - 1) * times + 1
    inner = fine[reach * times : reach * times + count]
    return CubicSpline(np.linspace(t[0], t[-1], count), inner)


def odd_extension(values: Array, before: int, after: int) -> Array:
    """Samples (n, k) with some before and after them, turned about the ends."""
    ends = [2 * values[0] - values[before:0:-1],
            values,
            2 * values[-1] - values[-2 : -2 - after : -1]]  # fmt: skip
    return np.concatenate(ends)
