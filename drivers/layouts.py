"""Extracts fields from many frames at once, where most frames have the same layout.

A device mostly sends messages with the same fields at the same places. So the layout of
one frame is read byte by byte, and applied to all frames that have the same layout.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.drivers.framing import Bytes, FrameScan, Index, as_doubles, byte_rows


@dataclass(frozen=True, slots=True)
class Layout:
    """Where the fields of a frame are.

    Attributes
    ----------
    fields : by key, first byte and length in the frame
    marks : numbers of the bytes that determine the layout; equal in all its frames

    """

    fields: Mapping[int, tuple[int, int]]
    marks: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class SameLayoutFrames:
    """Frames of one layout.

    Attributes
    ----------
    which : (m,) their indices among all frames
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
    """Samples as decoded from frames, before they get their time.

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


def join_in_frame_order(parts: Iterable[RawSamples]) -> RawSamples | None:
    """Join samples of several layouts, sorted by the index of their frames."""
    some = list(parts)
    if not some:
        return None
    if len(some) == 1:
        return some[0]
    joined = [np.concatenate(column) for column in zip(*some, strict=True)]
    order = np.argsort(joined[0], kind="stable")
    return RawSamples(*(column[order] for column in joined))


LayoutReader = Callable[[bytes], Layout | None]


def sort_by_layout(
    data: Bytes, found: FrameScan, read_layout: LayoutReader
) -> Iterator[SameLayoutFrames]:
    """Sort frames by layout; frames without a layout are left out."""
    left = np.arange(len(found.starts))
    lengths = found.ends - found.starts
    while len(left):
        first = left[0]
        size = int(lengths[first])
        layout = read_layout(data[found.starts[first] : found.ends[first]].tobytes())
        if layout is None:
            left = left[1:]
            continue
        candidates = lengths[left] == size
        same = left[candidates]
        frames = byte_rows(data, found.starts[same], size)
        match = np.ones(len(same), dtype=bool)
        for mark in layout.marks:
            match &= frames[:, mark] == frames[0, mark]
        if not match.all():
            same, frames = same[match], frames[match]
            candidates[candidates] = match
        yield SameLayoutFrames(same, frames, layout.fields)
        left = left[~candidates]
