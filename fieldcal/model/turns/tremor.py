"""Sway of the device at the ends of a turn.

The mean force of a window gives its mean attitude, but a turn is integrated from one
instant to another. If a base or a hand sways by the angle psi(t), rad, about the mean
attitude, the closure contains psi at both instants:

    var(phi_T) = <psi_p^2> + <psi_q^2>                                            (1)

psi is the integral of the gyroscopes over T seconds of the window, less a straight line
in time. The integral of white noise of density N, rad/s/sqrt(Hz), is a random walk.
After the line is subtracted, its mean square is on average

    <psi^2> = N^2 T / 15                                                          (2)

Source: MacNeill 1978 for (2).
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model import detections
from fieldcal.model.rows.row_source import RowSource


def sway_at_ends(source: RowSource, windows: Index) -> float:
    """Variance (1) of a closure about the axis where it is largest, rad^2.

    Parameters
    ----------
    source : samples
    windows : (2, 2) first and end sample of the windows before and after the turn

    """
    most = round(detections.WINDOW_EDGE_S * source.rate)
    (first, end), (start, last) = windows.tolist()
    before = slice(max(first, end - most), end)
    after = slice(start, min(last, start + most))
    scale = source.about.nominal["gyr_scale"]
    return sum(
        sway_variance(source.block.gyr[samples] / scale, 1 / source.rate)
        for samples in (before, after)
        if source.usable[samples, 3:].all()
    )


def sway_variance(rate: Array, step: float) -> float:
    """Mean square of psi about the axis where it is largest, rad^2.

    Parameters
    ----------
    rate : (n, 3) rad/s
    step : s between samples

    """
    n = len(rate)
    if n < detections.MIN_SAMPLES:
        return 0.0
    angle = np.cumsum((rate - rate.mean(axis=0)) * step, axis=0)
    line = np.linalg.qr(np.column_stack([np.ones(n), np.arange(n)]))[0]
    psi = angle - line @ (line.T @ angle)
    white = (np.diff(rate, n=2, axis=0) ** 2).mean(axis=0) / 6
    by_noise = white * step**2 * n / 15  # (2)
    return float(np.maximum((psi**2).mean(axis=0) - by_noise, 0.0).max())
