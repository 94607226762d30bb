"""Take fields out of many frames at once, where most frames look alike.

A device that sends one kind of message sends the same fields at the same places again
and again. So the fields of one frame are looked up byte by byte, and taken from all the
frames whose layout is the same.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.drivers.framing import Bytes, FrameScan, Index, as_doubles, rows


@dataclass(frozen=True, slots=True)
class Layout:
    """Where the fields of a frame are.

    Attributes
    ----------
    fields : by key, first byte and length in the frame
    marks : the bytes that say so: the same in every frame of this layout

    """

    fields: Mapping[int, tuple[int, int]]
    marks: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class AlikeFields:
    """Frames of one layout.

    Attributes
    ----------
    which : (m,) their numbers among all the frames
    frames : (m, bytes)
    fields : by key, first byte and length

    """

    which: Index
    frames: Bytes
    fields: Mapping[int, tuple[int, int]]

    def numbers(self, key: int | None, kind: str, n: int) -> Array:
        """First n numbers of a field as dtype `kind`, (m, n); nan if there is none."""
        if key is None or key not in self.fields:
            return np.full((len(self.frames), n), np.nan)
        first, _ = self.fields[key]
        size = n * np.dtype(kind).itemsize
        field = np.ascontiguousarray(self.frames[:, first : first + size])
        return as_doubles(field.view(kind))

    def first_of(self, keys: tuple[int, ...]) -> int | None:
        """Return the first of the keys that these frames have."""
        return next((key for key in keys if key in self.fields), None)


class RawSamples(NamedTuple):
    """Samples as frames carry them, without a common time.

    Attributes
    ----------
    which : (m,) numbers of the frames
    six : (m, 6) acc m/s^2, gyr rad/s
    temperature : (m,) deg C
    stamps : (m,) s, the device's own
    seq : (m,) the device's counter

    """

    which: Index
    six: Array
    temperature: Array
    stamps: Array
    seq: Array


def in_order(parts: Iterable[RawSamples]) -> RawSamples | None:
    """Join samples of several layouts in the order of their frames."""
    some = list(parts)
    if not some:
        return None
    if len(some) == 1:
        return some[0]
    joined = [np.concatenate(column) for column in zip(*some, strict=True)]
    order = np.argsort(joined[0], kind="stable")
    return RawSamples(*(column[order] for column in joined))


Walk = Callable[[bytes], Layout | None]


def sort_by_layout(data: Bytes, found: FrameScan, walk: Walk) -> Iterator[AlikeFields]:
    """Sort frames by layout; those that `walk` knows no layout for are left out."""
    left = np.arange(len(found.starts))
    lengths = found.ends - found.starts
    while len(left):
        first = left[0]
        size = int(lengths[first])
        layout = walk(data[found.starts[first] : found.ends[first]].tobytes())
        if layout is None:
            left = left[1:]
            continue
        candidates = lengths[left] == size
        same = left[candidates]
        frames = rows(data, found.starts[same], size)
        match = np.ones(len(same), dtype=bool)
        for mark in layout.marks:
            match &= frames[:, mark] == frames[0, mark]
        if not match.all():
            same, frames = same[match], frames[match]
            candidates[candidates] = match
        yield AlikeFields(same, frames, layout.fields)
        left = left[~candidates]
