"""Rows of a session that holds means alone: one for each position.

The samples of these means and the turns between them are not recorded. If no times are
stated, all means count as taken at the same time, and no effect that depends on time
can be found.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import Array
from fieldcal.model.rows.averages import Rows, average_rows
from fieldcal.model.rows.row_source import RowSource
from fieldcal.model.rows.window_bounds import window_bounds


def median_sigma(sigma: Array) -> Array:
    """Median of each channel's (p, 6) over the positions that have one, (6,)."""
    known = [axis[np.isfinite(axis)] for axis in sigma.T]
    return np.array([np.median(axis) if len(axis) else np.nan for axis in known])


def rows_of_means(source: RowSource, sigma: Array) -> Rows:
    """One row for each position of which there is a mean.

    Parameters
    ----------
    source : the means as samples, one in each window
    sigma : (p, 6) standard deviation of each position's means, m/s^2 and rad/s

    """
    windows = window_bounds(source.block, source.about)
    held = np.flatnonzero(np.diff(windows, axis=1)[:, 0] > 0)
    level = median_sigma(sigma[held])
    still = np.zeros((len(held), 3))
    out = average_rows(source, windows[held], held, sigma[held], level, still)
    x = out.x
    if not source.about.means_timed:
        same = np.zeros(len(held))
        x = replace(x, t=same, since_start=same)
    x = replace(x, since_turn=np.full(len(held), np.inf))
    off = np.zeros_like(out.sd)
    earth = EARTH_RATE / 3**0.5 * np.abs(source.about.nominal["gyr_scale"])
    off[~x.oriented & (len(held) > 1), 3:] = earth
    return replace(out, x=x, window_error=off)
