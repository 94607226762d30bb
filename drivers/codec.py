"""What a serial wire format is: bytes in, samples out, no I/O and no clock.

To add one, write drivers/protocols/<name>.py with a subclass of `Codec` named `Codec`;
``format=<name>`` then finds it. What comes out does not depend on how the bytes were
cut, except for the arrival times; memory is bounded by the longest frame.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar, NamedTuple

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.plugins import module_names, plugin_class
from fieldcal.core.samples import Array, Block, Grain, concat
from fieldcal.drivers import protocols
from fieldcal.drivers.driver import LinkHealth
from fieldcal.drivers.framing import (
    Bytes,
    FrameCandidates,
    FrameScan,
    Index,
    select_frames,
)
from fieldcal.drivers.layouts import RawSamples
from fieldcal.drivers.options import Options
from fieldcal.drivers.reader import Chunk
from fieldcal.drivers.timebase import Timebase

LEAST_SAMPLES = 3
"""Samples that make a format likely."""

LEAST_SCORE = 0.25
"""Score from which a format is named."""


class FormatMatch(NamedTuple):
    """How well bytes fit a format, 0 to 1, the options it takes, samples found."""

    score: float
    query: str
    samples: int


class Codec(ABC):
    """A decoder with a memory for what is not whole yet.

    Attributes
    ----------
    bauds : rates such devices use, bit/s, the factory's first
    longest : longest frame that is taken for one, bytes; no more is ever kept
    health : what was decoded and refused so far

    """

    bauds: ClassVar[tuple[int, ...]] = (115200, 921600, 9600, 57600, 230400, 460800)

    longest: ClassVar[int]

    def __init__(self, options: Options) -> None:
        self.health = LinkHealth()
        self._rest = b""
        self._arrivals: list[tuple[int, float]] = []
        self._begin = 0

    def feed(self, data: bytes, t_host: float = float("nan")) -> Block | None:
        """Decode bytes that arrived at `t_host` s; None if no sample got whole."""
        return self.feed_all([Chunk(t_host, data)])

    def feed_all(self, chunks: Sequence[Chunk]) -> Block | None:
        """Decode what arrived, in order; None if no sample got whole."""
        blocks, since = [], 0
        for i, chunk in enumerate(chunks):
            if chunk.broken:
                blocks.append(self._feed(chunks[since:i]))
                self.reset()
                since = i
        blocks.append(self._feed(chunks[since:]))
        whole = [block for block in blocks if block is not None and len(block)]
        if not whole:
            return None
        block = whole[0] if len(whole) == 1 else concat(whole)
        self.health.samples += len(block)
        return block

    def reset(self) -> None:
        """Forget what is not whole: the link was away."""
        self.health.skipped += len(self._rest)
        self._begin += len(self._rest)
        self._rest = b""

    @property
    def waiting_bytes(self) -> int:
        """Bytes kept until more come."""
        return len(self._rest)

    @classmethod
    def match(cls, data: bytes, seconds: float) -> FormatMatch | None:
        """Judge whether bytes that came in so many seconds are of this format."""
        return cls.match_decoded(data)

    @classmethod
    def match_decoded(cls, data: bytes, query: str = "") -> FormatMatch | None:
        """Judge bytes by the share that decodes with these options."""
        declared = f"{query}&rate=1" if query else "rate=1"
        codec = cls(Options("probe", declared))
        codec.feed(data, 0.0)
        health = codec.health
        if health.samples < LEAST_SAMPLES:
            return None
        share = 1 - health.skipped / health.received
        return FormatMatch(share, query, health.samples)

    @property
    def grain(self) -> Grain:
        """What the format rounds to; a format of floating point to nothing."""
        return Grain()

    @abstractmethod
    def scan(self, data: Bytes) -> FrameCandidates:
        """Say where frames may begin."""

    @abstractmethod
    def decode(self, data: Bytes, found: FrameScan, t_host: Array) -> Block | None:
        """Make samples of whole frames; `t_host` is the arrival of each one's end."""

    def _timed(
        self,
        clock: Timebase,
        raw: RawSamples | None,
        t_host: Array,
        steps: Array | None = None,
    ) -> Block | None:
        """Give samples their time; those with an old stamp are left out.

        Parameters
        ----------
        clock : what tells the time
        raw : the samples, in order; `which` numbers the frames they ended with
        t_host : arrivals of the frames, s
        steps : (m,) periods since the sample before; 1 if not given

        """
        if raw is None or not len(raw.six):
            return None
        ones = np.ones(len(raw.six))
        arrived = t_host[raw.which]
        t = clock.times(raw.stamps, ones if steps is None else steps, arrived)
        new = ~np.isnan(t) if np.isnan(t).any() else slice(None)
        columns = (raw.six[:, :3], raw.six[:, 3:], raw.temperature, raw.seq, arrived)
        return Block.of(t[new], *(column[new] for column in columns))

    def _feed(self, chunks: Sequence[Chunk]) -> Block | None:
        if not chunks:
            return None
        data = b"".join([self._rest, *(chunk.data for chunk in chunks)])
        end = self._begin + len(self._rest)
        for chunk in chunks:
            end += len(chunk.data)
            self._arrivals.append((end, chunk.t_host))
        self.health.received += len(data) - len(self._rest)
        array = np.frombuffer(data, np.uint8)
        found = select_frames(self.scan(array), len(data))
        self.health.bad += found.bad
        self.health.skipped += found.skipped
        block = None
        if len(found.starts):
            block = self.decode(array, found, self._arrived(found.ends))
        self._rest = data[found.rest :]
        self._begin += found.rest
        self._arrivals = [mark for mark in self._arrivals if mark[0] > self._begin]
        return block

    def _arrived(self, ends: Index) -> Array:
        """When the frames that end there were all there, (m,) s."""
        marks = np.array(self._arrivals)
        done = np.searchsorted(ends, marks[:, 0] - self._begin, side="right")
        return np.repeat(marks[:, 1], np.diff(done, prepend=0))


def recognise_format(data: bytes, seconds: float) -> tuple[str, FormatMatch] | None:
    """Name the format that bytes fit best, and how well; None if they fit none."""
    found = []
    for name in wire_formats():
        like = codec_class(name).match(data, seconds)
        if like is not None and like.score > LEAST_SCORE:
            found.append((name, like))
    return max(found, key=lambda pair: pair[1].score, default=None)


def wire_formats() -> tuple[str, ...]:
    """Names of the wire formats there are."""
    return module_names(protocols.__path__)


def open_codec(name: str, options: Options) -> Codec:
    """Make the codec of a wire format.

    Raises
    ------
    InputError
        If there is no such format, or it refuses its options.

    """
    return codec_class(name)(options)


def codec_class(name: str) -> type[Codec]:
    """Return the class of a wire format; InputError if there is none."""
    if name not in wire_formats():
        known = ", ".join(wire_formats())
        raise InputError(f"no wire format {name!r}: there are {known}")
    return plugin_class(f"{protocols.__name__}.{name}", Codec)  # type: ignore[type-abstract]
