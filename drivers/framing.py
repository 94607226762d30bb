"""Find whole frames in a stretch of bytes, all at once.

A frame is looked for at every byte: the first candidate whose check holds is taken, and
the next is looked for behind it; after one whose check fails, at the next byte. That
is a scan from left to right, and candidates that do not overlap need no scan.

A candidate that is not all there yet is *open*. Nothing behind an open one is decided
before it is, so the outcome does not depend on how the bytes were cut.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array

Bytes = NDArray[np.uint8]
Index = NDArray[np.integer[Any]]
Mask = NDArray[np.bool_]


class FrameCandidates(NamedTuple):
    """Where frames may begin, in order; `good` holds for an open one as well.

    Attributes
    ----------
    starts, ends : (m,) byte numbers
    good : (m,) the check holds, or the candidate is open
    undecided : first byte that cannot be judged before more come

    """

    starts: Index
    ends: Index
    good: Mask
    undecided: int


class FrameScan(NamedTuple):
    """Whole frames, where the undecided rest begins, and what was refused."""

    starts: Index
    ends: Index
    rest: int
    bad: int
    skipped: int


def keep_disjoint(starts: Index, ends: Index) -> Mask:
    """Keep the first of those that overlap, from left to right, (m,)."""
    keep = np.ones(len(starts), dtype=bool)
    clashes = np.flatnonzero(starts[1:] < ends[:-1]) + 1
    done = 0
    for clash in clashes.tolist():
        if clash <= done:
            continue
        free, done = ends[clash - 1], clash
        while done < len(starts) and starts[done] < free:
            keep[done] = False
            done += 1
    return keep


def select_frames(candidates: FrameCandidates, size: int) -> FrameScan:
    """Take the frames in order out of `size` bytes.

    >>> starts = np.array([0, 3, 11])
    >>> good = np.array([True, True, True])
    >>> select_frames(FrameCandidates(starts, starts + 11, good, 16), 16)[:3]
    (array([0]), array([11]), 11)
    """
    starts, ends, good, undecided = candidates
    first, last = starts[good], ends[good]
    kept = keep_disjoint(first, last)
    first, last = first[kept], last[kept]
    rest = min(size, max(undecided, int(last[-1]) if len(last) else 0))
    if len(last) and last[-1] > size:
        rest = int(first[-1])
        first, last = first[:-1], last[:-1]
    refused = starts[~good & (starts < rest)]
    if len(last) and len(refused):
        before = np.searchsorted(first, refused, side="right") - 1
        refused = refused[(before < 0) | (refused >= last[before])]
    skipped = rest - int(np.sum(last - first))
    return FrameScan(first, last, rest, len(refused), skipped)


def find_headed_frames(
    data: Bytes,
    sync: bytes,
    head: int,
    longest: int,
    size: Callable[[Bytes, Index], Index],
    check: Callable[[Bytes, Index, Index], Mask],
) -> FrameCandidates:
    """Look for frames that begin with two bytes and say how long they are.

    Parameters
    ----------
    data : the bytes
    sync : the two bytes
    head : bytes of the header, up to the length
    longest : longest frame that is taken for one, bytes
    size : from bytes and starts to the sizes of the frames, (m,)
    check : from bytes, starts and ends of whole frames to whether their check holds

    """
    starts = np.flatnonzero(data[:-1] == sync[0])
    starts = starts[data[starts + 1] == sync[1]]
    padded = np.concatenate([data, np.zeros(head, np.uint8)])
    ends = starts + size(padded, starts)
    cut = starts + head > len(data)
    ends[cut] = len(data) + 1
    possible = cut | (ends - starts <= longest)
    starts, ends = starts[possible], ends[possible]
    good = np.ones(len(starts), dtype=bool)
    whole = np.flatnonzero(ends <= len(data))
    good[whole] = check(data, starts[whole], ends[whole])
    half = len(data) > 0 and int(data[-1]) == sync[0]
    return FrameCandidates(starts, ends, good, len(data) - half)


def byte_rows(data: Bytes, starts: Index, size: int) -> Bytes:
    """Return the `size` bytes from each start, (m, size)."""
    if len(starts) > 1 and starts[-1] - starts[0] == size * (len(starts) - 1):
        if np.all(np.diff(starts) == size):
            return data[starts[0] : starts[-1] + size].reshape(-1, size)
    return np.lib.stride_tricks.sliding_window_view(data, size)[starts]


def as_doubles(numbers: NDArray[Any]) -> Array:
    """Return numbers of any width as doubles; a signalling nan is a nan like others."""
    with np.errstate(invalid="ignore"):
        return numbers.astype(float)
