"""Assembles samples from CAN frames, many at once.

Frames belong to one sample if they carry the same key: a counter (``seq``) that all of
them have, or else a stamp (``t``). Keys are unwrapped in the order of arrival; a sample
is whole with its last frame, and given up once a later one is whole or `MOST_BEGUN`
newer ones have begun. Without a key, a sample begins with the frame called ``first``
(of the lowest identifier, which a bus lets pass first) and has each of the others once
before the next one begins; ``within`` is the longest that may take, in s.

What comes out does not depend on how the frames were cut into batches.
"""

from __future__ import annotations

from collections.abc import Sequence as Sequenced

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import CHANNELS, Array, Block, Grain
from fieldcal.drivers.can_fields import WORD_BYTES, Bytes
from fieldcal.drivers.can_frame_groups import (
    CanLinkHealth,
    DecodedFrames,
    FrameGrouper,
    Index,
    KeyGrouper,
    SequenceGrouper,
)
from fieldcal.drivers.can_frames import ERROR_FLAG, Frames
from fieldcal.drivers.can_map import COLUMNS, FramePart, SignalChannel
from fieldcal.drivers.chosen_timebase import ChosenTimebase
from fieldcal.drivers.options import Options
from fieldcal.drivers.sample_counter import SampleCounter
from fieldcal.drivers.timebase import Timebase

MOST_BEGUN = 8
"""Newer samples that may begin before an incomplete one is given up."""

OLDEST_FRAME = 0.1
"""Largest age of a frame to be grouped with others of the same stamp, s."""

WIDEST_KEY = 60
"""Most bits that a key may have."""

TEMPERATURE, STAMP, COUNTER = (COLUMNS.index(c) for c in ("temperature", "t", "seq"))


class CanAssembler:
    """Assembles samples, and keeps incomplete ones.

    Parameters
    ----------
    parts : kinds of frames and their channels
    health : counts decoded and refused frames
    options : ``first``, ``within`` and ``rate`` are taken from them

    """

    def __init__(
        self, parts: Sequenced[FramePart], health: CanLinkHealth, options: Options
    ) -> None:
        self._needed = [part for part in parts if not part.temperature_only]
        self._held = [part for part in parts if part.temperature_only]
        self._parts = [*self._needed, *self._held]
        self._by_identifier: dict[int, list[int]] = {}
        for number, part in enumerate(self._parts):
            self._by_identifier.setdefault(part.identifier, []).append(number)
        self.health = health
        self._keyed = next((c for c in ("seq", "t") if self._can_key(c)), "")
        first = self._begins(options.text("first"))
        within = options.number("within", float("inf"), 0.0, 60.0)
        stamp = self._channel("t")
        tick = stamp.field.scale * stamp.scale if stamp else 0.0
        span = tick * stamp.field.span if stamp else float("inf")
        self._clock: Timebase = ChosenTimebase(
            health, options, tick if span < np.inf else 0.0, span
        )
        counter = self._channel("seq")
        self._sequence = SampleCounter()
        if counter:
            states = counter.field.states
            self._sequence = SampleCounter(counter.field.span, states, states is None)
        self._temperature = float("nan")
        count = len(self._needed)
        self._groups: FrameGrouper = SequenceGrouper(count, health, first, within)
        if self._keyed:
            self._groups = KeyGrouper(count, health, *self._depth(tick))

    @property
    def grain(self) -> Grain:
        """One count of the coarsest signal of each sensor; 0 for floating point."""
        steps = []
        for names in (CHANNELS[:3], CHANNELS[3:]):
            some = [c for name in names if (c := self._channel(name))]
            counts = [c.field.scale * c.scale for c in some if not c.field.floating]
            steps.append(max(map(abs, counts), default=0.0))
        return Grain(steps[0], steps[1])

    def _channel(self, column: str) -> SignalChannel | None:
        return next(
            (p.channels[column] for p in self._needed if column in p.channels), None
        )

    def _can_key(self, column: str) -> bool:
        """Whether every frame of a sample has this column, of the same width."""
        spans = {
            part.channels[column].field.span if column in part.channels else np.inf
            for part in self._needed
        }
        return len(self._needed) > 1 and len(spans) == 1 and max(spans) <= 2**WIDEST_KEY

    def _begins(self, name: str) -> int:
        """Index of the part that begins a sample."""
        names = [part.name for part in self._needed]
        if name and name not in names:
            raise InputError(f"can: first={name} is none of {', '.join(names)}")
        if name:
            return names.index(name)
        bits = [part.identifier for part in self._needed]
        return bits.index(min(bits))

    def _depth(self, tick: float) -> tuple[int, int]:
        """Value at which the key wraps, and its largest difference from the newest."""
        channel = self._needed[0].channels[self._keyed]
        span = int(channel.field.span)
        deep = (
            MOST_BEGUN if self._keyed == "seq" else max(1, round(OLDEST_FRAME / tick))
        )
        return span, max(1, min(deep, span // 4))

    def reset(self) -> None:
        """Forget incomplete samples: the link was interrupted."""
        self._groups.reset()
        self._clock.link_broken()
        self._sequence.link_broken()

    def feed(self, frames: Frames, arrived: Array) -> Block | None:
        """Decode frames that arrived at these times, s; None if no sample got whole."""
        rows, whole = self._groups.feed(self._read(frames, arrived))
        if not len(whole.key):
            return None
        values = np.take(rows.values.T, whole.last, axis=1).T
        # if a sample is one frame, its row has all channels
        for number, part in enumerate(self._needed if len(self._needed) > 1 else ()):
            columns = [COLUMNS.index(column) for column in part.channels]
            values[:, columns] = rows.values[whole.rows[:, number, None], columns]
        return self._timed(values, rows.arrived[whole.last])

    def _timed(self, values: Array, arrived: Array) -> Block | None:
        """Block of samples (n, 9) with times; those with an old stamp are left out."""
        steps: Array = np.ones(len(values))
        if self._channel("seq"):
            steps = self._sequence.steps(values[:, COUNTER])
        t = self._clock.times(values[:, STAMP], steps, arrived)
        new = ~np.isnan(t)
        if not new.any():
            return None
        self.health.samples += int(new.sum())
        values = np.compress(new, values.T, axis=1).T
        acc, gyr, temperature = values[:, :3], values[:, 3:6], values[:, TEMPERATURE]
        return Block.of(t[new], acc, gyr, temperature, values[:, COUNTER], arrived[new])

    def _read(self, frames: Frames, arrived: Array) -> DecodedFrames:
        """Decode the frames that are in the map."""
        identifiers = frames["id"]
        errors = int(np.count_nonzero(identifiers & ERROR_FLAG))
        self.health.errors += errors
        known = 0
        part = np.full(len(frames), -1, np.int64)
        raw = np.zeros(len(frames), np.int64)
        # each channel contiguous in memory, since channels are processed one by one
        values = np.full((len(COLUMNS), len(frames)), np.nan).T
        for identifier, parts in self._by_identifier.items():
            of = np.flatnonzero(identifiers == identifier)
            known += len(of)
            size = max(self._parts[p].size for p in parts)
            whole = frames["size"][of] >= size
            self.health.bad += int(np.count_nonzero(~whole))
            of = of[whole]
            data = frames["data"][:, : max(size, WORD_BYTES)][of]
            for number in parts:
                if self._parts[number].selectors:
                    chosen = self._parts[number].carries(data)
                    self._decode(number, of[chosen], data[chosen], part, raw, values)
                else:
                    self._decode(number, of, data, part, raw, values)
        self.health.strange += len(frames) - known - errors
        return self._held_rows(DecodedFrames(part, raw, frames["t"], arrived, values))

    def _decode(
        self, number: int, of: Index, data: Bytes, part: Index, raw: Index, out: Array
    ) -> None:
        """Put the channels of one part into the rows `of`."""
        named = True
        for column, channel in self._parts[number].channels.items():
            values = channel.field.values(data) * channel.scale + channel.offset
            out[of, COLUMNS.index(column)] = values
            if channel.field.special or channel.field.floating:
                named = named & np.isfinite(values)
            if column == self._keyed:
                raw[of] = channel.field.bits(data)
        part[of] = np.where(named, number, -1)
        self.health.bad += int(np.count_nonzero(part[of] < 0))

    def _held_rows(self, rows: DecodedFrames) -> DecodedFrames:
        """Keep the frames of samples, and add the last temperature to them."""
        needed = (rows.part >= 0) & (rows.part < len(self._needed))
        held = rows.part >= len(self._needed)
        if self._held:
            at = np.maximum.accumulate(np.where(held, np.arange(len(held)), -1))
            degrees = rows.values[at, TEMPERATURE]
            degrees[at < 0] = self._temperature
            rows.values[:, TEMPERATURE] = degrees
            self._temperature = float(np.append(self._temperature, degrees)[-1])
        return rows if needed.all() else rows.take(needed)
