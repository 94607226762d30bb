"""Sway of the device at the ends of a turn.

The mean force of a window tells its mean attitude, and a turn is followed from one
instant to another. Where a base or a hand sways by psi(t) about the mean attitude, the
closure has what it sways by at both instants in it:

    var(phi_T) = <psi_p^2> + <psi_q^2>                                            (1)

psi is what the gyroscopes sum up to in the window, less a constant and a drift. White
noise of density N sums up to a walk, of which these leave, over T on average,

    <psi^2> = N^2 T / 15                                                          (2)

Source: MacNeill 1978 for (2).
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model.rows.reduce import RowSource

WINDOW_EDGE_S = 10.0
"""Time of a window next to the turn that is looked at, s."""

MIN_SAMPLES = 16
"""Least number of samples."""


def sway_at_ends(source: RowSource, windows: Index) -> float:
    """Variance (1) of a closure about the axis where it is largest, rad^2.

    Parameters
    ----------
    source : samples
    windows : (2, 2) bounds of those before and after the turn, in samples

    """
    most = round(WINDOW_EDGE_S * source.rate)
    (first, end), (start, last) = windows.tolist()
    before = slice(max(first, end - most), end)
    after = slice(start, min(last, start + most))
    scale = source.about.nominal["gyr_scale"]
    return sum(
        sway_variance(source.block.gyr[some] / scale, 1 / source.rate)
        for some in (before, after)
        if source.usable[some, 3:].all()
    )


def sway_variance(rate: Array, step: float) -> float:
    """Mean square of psi about the axis where it is largest, rad^2.

    Parameters
    ----------
    rate : (n, 3) rad/s
    step : s between samples

    """
    n = len(rate)
    if n < MIN_SAMPLES:
        return 0.0
    angle = np.cumsum((rate - rate.mean(axis=0)) * step, axis=0)
    flat = np.linalg.qr(np.column_stack([np.ones(n), np.arange(n)]))[0]
    psi = angle - flat @ (flat.T @ angle)
    white = (np.diff(rate, n=2, axis=0) ** 2).mean(axis=0) / 6
    walked = white * step**2 * n / 15  # (2)
    return float(np.maximum((psi**2).mean(axis=0) - walked, 0.0).max())
