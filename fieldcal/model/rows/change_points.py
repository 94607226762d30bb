"""Instants at which the outputs of a rest change most, from one row to the next.

A jump that lies between two instants to be tried looks like a walk until the nearer of
them is refined, and what looks so is taken for one. So where each output changes most
is tried as well: of the means of m rows on either side the largest difference

    |mean of m after - mean of m before| / sqrt(var of both),   m = 1, 2, 4, 8      (1)

Beside a clear jump, the means differ by far more than the rows scatter about them; what
comes and goes, as a line in the spectrum does, scatters about them as much.

Source: moving-sum statistic for a change of the mean; Eichinger & Kirch 2018,
Bernoulli 24(1).
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model import detections
from fieldcal.model.rows.averages import Rows


def change_points(rows: Rows) -> Array:
    """The instant between rows at which each output changes most, (k,) s, k <= 6."""
    largest: dict[int, tuple[float, float]] = {}
    for window in _windows(rows):
        for c in range(6):
            used = window[rows.used[window, c]]
            for m in detections.ROWS_BESIDE_JUMP:
                if len(used) < 2 * m:
                    break
                size = _changes(rows.y[used, c], rows.sd[used, c] ** 2, m)
                k = int(np.argmax(size))
                best = largest.get(c, (0.0, 0.0))
                at = _between(rows, used[k + m - 1], used[k + m])
                largest[c] = max(best, (float(size[k]), at))
    return np.unique([at for _, at in largest.values()])


def clear_jumps(rows: Rows) -> list[tuple[float, float]]:
    """Start and end of each row that a clear jump lies in or next to, s.

    Of each output of a window the largest.
    """
    jumps, m = set[tuple[float, float]](), detections.ROWS_BESIDE_JUMP[-1]
    for window in _windows(rows):
        for c in range(6):
            used = window[rows.used[window, c]]
            if len(used) < 2 * m + 1:
                continue
            beside = np.lib.stride_tricks.sliding_window_view(rows.y[used, c], m)
            before, after = beside[: -m - 1], beside[m + 1 :]  # a row lies between
            scatter = (before.var(axis=1, ddof=1) + after.var(axis=1, ddof=1)) / m
            change = after.mean(axis=1) - before.mean(axis=1)
            k = int(
                np.argmax(
                    np.abs(change) - detections.CLEAR_JUMP_SIGMAS * np.sqrt(scatter)
                )
            )
            if abs(change[k]) > detections.CLEAR_JUMP_SIGMAS * np.sqrt(scatter[k]):
                start, end = rows.span[used[k + m]].tolist()
                jumps.add((start, end))
    return sorted(jumps)


def _windows(rows: Rows) -> list[Index]:
    """Rows of each window."""
    turned = np.flatnonzero(np.diff(rows.x.position)) + 1
    return np.split(np.arange(len(rows.x.t)), turned)


def _changes(y: Array, variance: Array, m: int) -> Array:
    """Size of the change behind each of the rows m - 1 to n - m - 1, (1)."""
    mean, spread = (
        np.convolve(values, np.full(m, 1 / m), "valid") for values in (y, variance)
    )
    size: Array = np.abs(mean[m:] - mean[:-m]) / np.sqrt((spread[m:] + spread[:-m]) / m)
    return size


def _between(rows: Rows, before: int, after: int) -> float:
    """The instant between the end of one row and the start of another, s."""
    return float((rows.span[before, 1] + rows.span[after, 0]) / 2)
