"""Samples held up on their way, each batch by another while: jitter of the arrival."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from time import monotonic

from fieldcal.core.samples import Block
from fieldcal.sim_device.random_process import random_stream


class SampleDelay:
    """Queue that delays samples and keeps their order; false while it is empty.

    Attributes
    ----------
    mean : mean delay of an exponential distribution, s of the wall clock

    """

    def __init__(self, seed: int) -> None:
        self.mean = 0.0
        self._rng = random_stream(seed, "delay")
        self._held: deque[tuple[float, Block]] = deque()
        self._last = 0.0

    def __bool__(self) -> bool:
        return bool(self._held)

    def hold(self, block: Block) -> None:
        """Take samples in."""
        late = self._rng.exponential(self.mean) if self.mean else 0.0
        self._last = max(self._last, monotonic() + late)
        self._held.append((self._last, block))

    def over(self, now: float | None = None) -> Iterator[Block]:
        """Let out what has been held long enough, at `now` s of the wall clock."""
        until = monotonic() if now is None else now
        while self._held and self._held[0][0] <= until:
            yield self._held.popleft()[1]

    def forget(self) -> None:
        """Drop what is held: the link is gone."""
        self._held.clear()
