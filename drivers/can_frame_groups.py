"""Finds the frames that belong to one sample.

By key: frames with the same number belong together; it is unwrapped in the order of
arrival. A sample is complete with its last frame. It is given up once a later one is
complete, or a limited number of newer ones have begun. By sequence: a sample begins
with one kind of frame, and has each of the others once before the next sample begins.

The result does not depend on how the frames were divided into batches, and the number
of waiting frames is bounded.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import reduce
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array
from fieldcal.drivers.driver import LinkHealth

Index = NDArray[np.int64]


@dataclass(slots=True)
class CanLinkHealth(LinkHealth):
    """Counts of a CAN link.

    Attributes
    ----------
    errors : error frames of the bus
    incomplete : samples of which a frame was missing
    strange : frames that are not in the map

    """

    errors: int = 0
    incomplete: int = 0
    strange: int = 0


class DecodedFrames(NamedTuple):
    """Decoded frames, in the order of their arrival.

    Attributes
    ----------
    part : (m,) number of the kind of frame
    key : (m,) number that the frames of one sample share
    t, arrived : (m,) s, stamp of the bus and arrival
    values : (m, k) SI, nan where the frame has none

    """

    part: Index
    key: Index
    t: Array
    arrived: Array
    values: Array

    def take(self, which: Any) -> DecodedFrames:
        """Return selected rows."""
        return DecodedFrames(*(column[which] for column in self))

    def followed_by(self, more: DecodedFrames) -> DecodedFrames:
        """Return these rows followed by `more`."""
        if not len(self.key):
            return more
        pairs = zip(self, more, strict=True)
        return DecodedFrames(*(np.concatenate(pair) for pair in pairs))


class CompletedSamples(NamedTuple):
    """Samples in the order in which they were completed.

    Attributes
    ----------
    key : (n,) of each sample
    rows : (n, parts) row of each part
    last : (n,) last row of each sample

    """

    key: Index
    rows: Index
    last: Index

    def take(self, which: Any) -> CompletedSamples:
        """Return selected samples."""
        return CompletedSamples(self.key[which], self.rows[which], self.last[which])


class FrameGrouper(ABC):
    """Groups frames into samples, and keeps those of incomplete samples.

    Parameters
    ----------
    parts : kinds of frames that a sample has
    health : counts incomplete samples

    """

    def __init__(self, parts: int, health: CanLinkHealth) -> None:
        self._parts, self._health = parts, health
        self._rest: DecodedFrames | None = None

    @abstractmethod
    def feed(self, new: DecodedFrames) -> tuple[DecodedFrames, CompletedSamples]:
        """Return rows, including kept ones, and the samples completed by them."""

    def reset(self) -> None:
        """Forget incomplete samples."""
        self._rest = None

    def _after_rest(self, new: DecodedFrames) -> DecodedFrames:
        return self._rest.followed_by(new) if self._rest else new

    def _whole(self, rows: DecodedFrames) -> tuple[CompletedSamples, Index]:
        """Find samples with all parts, and the first row of each part and key."""
        return self._regular(rows) or self._any_order(rows)

    def _regular(self, rows: DecodedFrames) -> tuple[CompletedSamples, Index] | None:
        """As `_whole`, if the parts come in a fixed order, as they nearly always do."""
        n, left = divmod(len(rows.key), self._parts)
        if not n:
            return None
        turn = rows.part[: self._parts]
        place = np.argsort(turn)
        key = rows.key[: n * self._parts].reshape(n, self._parts)
        later = rows.key[n * self._parts :]
        if not (
            np.array_equal(turn[place], np.arange(self._parts))
            and np.array_equal(rows.part[self._parts :], rows.part[: -self._parts])
            and (key == key[:, :1]).all()
            and (np.diff(key[:, 0]) > 0).all()
            and (later == later[:1]).all()
            and (later > key[-1, 0]).all()
        ):
            return None
        begin = self._parts * np.arange(n)
        last = begin + self._parts - 1
        whole = CompletedSamples(key[:, 0], begin[:, None] + place, last)
        return whole, np.arange(len(rows.key))

    def _any_order(self, rows: DecodedFrames) -> tuple[CompletedSamples, Index]:
        keys, places = [], []
        for number in range(self._parts):
            of = np.flatnonzero(rows.part == number)
            some, first = np.unique(rows.key[of], return_index=True)
            keys.append(some)
            places.append(of[first])
        common = reduce(np.intersect1d, keys)
        pairs = zip(keys, places, strict=True)
        table = np.column_stack([p[np.searchsorted(k, common)] for k, p in pairs])
        last = table.max(axis=1)
        order = np.argsort(last)
        whole = CompletedSamples(common, table, last).take(order)
        return whole, np.sort(np.concatenate(places))


class KeyGrouper(FrameGrouper):
    """Groups frames by key.

    Parameters
    ----------
    parts, health : as in `FrameGrouper`
    span : value at which the key wraps
    deep : largest difference of a key from the newest

    """

    def __init__(self, parts: int, health: CanLinkHealth, span: int, deep: int) -> None:
        super().__init__(parts, health)
        self._span, self._deep = span, deep
        self.reset()

    def reset(self) -> None:
        """Forget incomplete samples, and restart the unwrapping."""
        super().reset()
        self._raw, self._key = -1, 0
        self._newest = self._done = -1

    def feed(self, new: DecodedFrames) -> tuple[DecodedFrames, CompletedSamples]:
        """Group frames with the same key."""
        rows = self._after_rest(new._replace(key=self._unwrapped(new.key)))
        whole, firsts = self._whole(rows)
        if not len(rows.key):
            return rows, whole
        newest = np.maximum(np.maximum.accumulate(rows.key), self._newest)
        later = np.maximum.accumulate(np.concatenate([[self._done], whole.key]))[:-1]
        behind = newest[whole.last] - whole.key
        whole = whole.take((whole.key > later) & (behind <= self._deep))
        before, self._newest = self._done, int(newest[-1])
        if len(whole.key):
            self._done = int(whole.key[-1])
        key = rows.key[firsts]
        waits = (key > self._done) & (self._newest - key <= self._deep)
        if len(firsts) > self._parts * len(whole.key) + np.count_nonzero(waits):
            begun = np.unique(key[~waits & (key > before)])
            self._health.incomplete += len(begun) - len(whole.key)
        self._rest = rows.take(firsts[waits])
        return rows, whole

    def _unwrapped(self, raw: Index) -> Index:
        if not len(raw):
            return raw
        before = raw[0] if self._raw < 0 else self._raw
        steps = (np.diff(raw, prepend=before) + self._deep) % self._span - self._deep
        key: Index = self._key + np.cumsum(steps)
        self._raw, self._key = int(raw[-1]), int(key[-1])
        return key


class SequenceGrouper(FrameGrouper):
    """Groups frames by their sequence.

    Parameters
    ----------
    parts, health : as in `FrameGrouper`
    first : number of the part that begins a sample
    within : longest time that a sample may take on the bus, s

    """

    def __init__(
        self, parts: int, health: CanLinkHealth, first: int, within: float
    ) -> None:
        super().__init__(parts, health)
        self._first, self._within = first, within

    def feed(self, new: DecodedFrames) -> tuple[DecodedFrames, CompletedSamples]:
        """Group successive frames; a sample with a doubled frame is given up."""
        rows = self._after_rest(new)
        rows = rows._replace(key=np.cumsum(rows.part == self._first))
        begun = rows.key > 0
        self._orphans(rows.part[~begun])
        rows = rows if begun.all() else rows.take(begun)
        whole, firsts = self._whole(rows)
        turns = int(rows.key[-1]) if len(rows.key) else 0
        again = np.ones(len(rows.key), dtype=bool)
        again[firsts] = False
        first_again = np.full(turns + 1, len(rows.key))
        np.minimum.at(first_again, rows.key[again], np.flatnonzero(again))
        good = first_again[whole.key] > whole.last
        took = rows.t[whole.last] - rows.t[whole.rows[:, self._first]]
        good &= took <= self._within
        waits = (
            turns > 0 and turns not in whole.key and not again[rows.key == turns].any()
        )
        self._rest = rows.take(rows.key == turns) if waits else None
        self._health.incomplete += turns - int(waits) - int(good.sum())
        whole = whole.take(good)
        ends = np.full(turns + 1, len(rows.key))
        ends[whole.key] = whole.last
        self._orphans(rows.part[np.arange(len(rows.key)) > ends[rows.key]])
        return rows, whole

    def _orphans(self, part: Index) -> None:
        """Count samples whose first frame was missing."""
        self._health.incomplete += int(np.bincount(part, minlength=1).max())
