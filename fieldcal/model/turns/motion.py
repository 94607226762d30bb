"""Bounds of the motion between two windows, by the gyroscopes."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.core.sampling import has_no_pause
from fieldcal.model import detections, thresholds
from fieldcal.model.rows.averages import Rows
from fieldcal.model.rows.row_source import RowSource


def motion_bounds(
    source: RowSource, rows: Rows, pair: tuple[int, int], first: int, last: int
) -> tuple[int, int] | None:
    """Bounds of the motion between two windows, in samples.

    None if samples are missing, or if the motion is too long to be integrated.

    Parameters
    ----------
    source, rows : samples, and the rows of the windows
    pair : positions of the windows
    first, last : samples [first, last) are the gap between the windows

    """
    block, rate = source.block, source.rate
    gap, m = slice(first, last), max(2, round(detections.TURN_MEAN_S * rate))
    if last - first < 4 * m or not source.usable[gap].all():
        return None
    if not has_no_pause(block.t, first, last, rate):
        return None
    whole = (
        (first, last)
        if block.t[last - 1] - block.t[first] < detections.MAX_TURN_S
        else None
    )
    rates = [rows.y[rows.x.position == p, 3:] for p in pair]
    if not all(np.isfinite(window_rates).any(axis=0).all() for window_rates in rates):
        return whole  # the rates at rest are not known
    unit = np.abs(source.about.nominal["gyr_scale"])
    gyr, noise = block.gyr[gap] / unit, rows.noise[3:] / unit
    rest = [np.nanmean(window_rates, axis=0) / unit for window_rates in rates]
    total = np.vstack([np.zeros(3), np.cumsum(gyr - rest[1], axis=0)])
    mean_rate = np.abs(total[m:] - total[:-m]) / m
    limit = np.maximum(
        detections.MOTION_SIGMAS * noise / np.sqrt(m), detections.MIN_MOTION_RATE
    )
    at = np.flatnonzero((mean_rate > limit).any(axis=1))
    if not (len(at) and (mean_rate / limit).max() > detections.MIN_MOTION_RATIO):
        return whole
    nearby = round(detections.BELONGING_S * rate)
    before = gyr[max(at[0] - nearby, 0) : at[0]] - rest[0]
    after = gyr[at[-1] + m : at[-1] + m + nearby] - rest[1]
    margin = round(detections.MOTION_MARGIN_S * rate)
    start = first + int(at[0]) - _moving_at_end(before, noise) - margin
    end = first + int(at[-1]) + m + _moving_at_end(after[::-1], noise) + margin
    start, end = max(start, first), min(end, last)
    return (
        (start, end)
        if block.t[end - 1] - block.t[start] < detections.MAX_TURN_S
        else None
    )


def _moving_at_end(rates: Array, noise: Array) -> int:
    """Number of samples from where the integrated angle exceeds its noise to the end.

    The integral shows rotation that is too slow to be seen in single samples. `rates`
    (n, 3) are samples less the rate at rest; `noise` (3,) is that of one sample.
    """
    angle = np.abs(np.cumsum(rates, axis=0))
    spread = noise * np.sqrt(np.arange(1, len(rates) + 1))[:, None]
    moved = (angle > thresholds.DECIDES * spread).any(axis=1)
    return len(rates) - int(np.argmax(moved)) if moved.any() else 0
