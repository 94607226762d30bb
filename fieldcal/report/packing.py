"""A recording packed for the page, so that an hour at 1 kHz stays fast and small.

What fits is packed sample by sample. What does not is packed twice:

    base      bins of equal device time, each with the least and the greatest value
    details   stretches sample by sample, where somebody will want to look closely

so that no peak is lost at any zoom and the edges of windows can be seen in full. The
page makes the coarser levels itself, by joining bins.

Values are whole numbers of 16 bit, in pieces of 64 with an offset o and a step s each:

    v = o + s q,   s = (greatest - least of the piece) / 65534

so the error is at most s/2, a 131 000th of what the piece spans; q = 65535 is a missing
value. Times are microseconds from the start of the stretch, 32 bit.
"""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fieldcal.core.samples import Array

PIECE = 64
"""Values that share an offset and a step."""

STEPS = 65534
MISSING = 65535

BASE_BYTES = 3_200_000
DETAIL_BYTES = 1_300_000
"""Largest size of each in the page, base64."""

_TEXT = 4 / 3
_VALUE = (2 + 8 / PIECE) * _TEXT
_TIME = 4 * _TEXT
"""Bytes of base64 for one value and one time."""

MAX_STRETCH_S = 4000.0
"""Longest stretch that 32 bit of microseconds can count, s."""


@dataclass(frozen=True, slots=True)
class ChannelTable:
    """Channels over time: t (n,) s, values (n, c); nan where missing."""

    t: Array
    values: Array


def pack(
    columns: ChannelTable, closely: Iterable[tuple[float, float]]
) -> dict[str, Any]:
    """Pack a recording.

    Parameters
    ----------
    columns : t strictly increasing, at least two rows
    closely : stretches (from, to) in s that are wanted sample by sample, the most
        wanted first

    """
    t, c = columns.t, columns.values.shape[1]
    span = float(t[-1] - t[0])
    sample = _TIME + c * _VALUE
    if len(t) * sample <= BASE_BYTES and span < MAX_STRETCH_S:
        return {"base": _samples(columns), "details": []}
    bins = int(BASE_BYTES / (2 * c * _VALUE))
    wanted = _select_stretches(columns, closely, DETAIL_BYTES / sample)
    details = [_samples(part) for part in wanted]
    return {"base": _bins(columns, bins), "details": details}


def _select_stretches(
    columns: ChannelTable, closely: Iterable[tuple[float, float]], most: float
) -> list[ChannelTable]:
    """Select stretches of `most` samples in all, in order of time, without overlap."""
    taken = np.zeros(len(columns.t) + 1, dtype=bool)
    left = most
    for start, end in closely:
        first, last = np.searchsorted(columns.t, [start, end])
        new = int((~taken[first:last]).sum())
        if last - first > 1 and new <= left:
            taken[first:last] = True
            left -= new
    edges = np.flatnonzero(np.diff(taken.astype(int), prepend=0))
    # a pause may be longer than times from a start can tell
    paused = np.flatnonzero(np.diff(columns.t) > MAX_STRETCH_S / 2) + 1
    inside = paused[taken[paused - 1] & taken[paused]]
    pairs = np.sort(np.concatenate([edges, inside, inside])).reshape(-1, 2)
    return [
        ChannelTable(columns.t[a:b], columns.values[a:b]) for a, b in pairs if b - a > 1
    ]


def _samples(columns: ChannelTable) -> dict[str, Any]:
    start = float(columns.t[0])
    times = np.round((columns.t - start) * 1e6).astype("<u4")
    return {
        "start": start,
        "n": len(times),
        "times": _text(times),
        "low": [quantise(v) for v in columns.values.T],
    }


def _bins(columns: ChannelTable, n: int) -> dict[str, Any]:
    t = columns.t
    start, dt = float(t[0]), float(t[-1] - t[0]) / n * (1 + 1e-12)
    index = np.minimum((t - start) // dt, n - 1).astype(int)
    first = np.flatnonzero(np.diff(index, prepend=-1))
    low, high = (np.full((n, columns.values.shape[1]), np.nan) for _ in range(2))
    low[index[first]] = np.fmin.reduceat(columns.values, first, axis=0)
    high[index[first]] = np.fmax.reduceat(columns.values, first, axis=0)
    return {
        "start": start,
        "n": n,
        "dt": dt,
        "low": [quantise(v) for v in low.T],
        "high": [quantise(v) for v in high.T],
    }


def quantise(values: Array) -> dict[str, str]:
    """Values (n,) as 16 bit whole numbers with their offsets and steps, base64."""
    n = len(values)
    table = np.full((-(-n // PIECE), PIECE), np.nan)
    table.ravel()[:n] = values
    known = np.isfinite(table)
    some = known.any(axis=1)
    low = np.where(some, np.where(known, table, np.inf).min(axis=1), 0.0)
    high = np.where(some, np.where(known, table, -np.inf).max(axis=1), 0.0)
    offset = low.astype("<f4")
    step = ((high - low) / STEPS).astype("<f4")
    divisor = np.where(step > 0, step, 1.0)[:, None].astype(float)
    scaled = np.where(known, table - offset[:, None].astype(float), 0.0) / divisor
    q = np.where(known, np.clip(np.round(scaled), 0, STEPS), MISSING).astype("<u2")
    scale = np.column_stack([offset, step]).astype("<f4")
    return {"q": _text(q.ravel()[:n]), "scale": _text(scale)}


def stretches_around(
    instants: Sequence[float], seconds: float
) -> list[tuple[float, float]]:
    """Stretches of `seconds` about each instant."""
    return [(at - seconds / 2, at + seconds / 2) for at in instants]


def _text(array: np.ndarray[Any, Any]) -> str:
    return base64.b64encode(array.tobytes()).decode("ascii")
