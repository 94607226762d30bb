"""Steps of a device's clock, taken out of the times of a recording.

A device counts from its start until a receiver or a host tells it the time of day: then
its times go on some fifty years later, and the samples as before. Such a step is not
time that passed. It is taken out, and kept as a mark: the times behind it go on one
period after the last before it.
"""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array, Block, concat

Index = NDArray[np.intp]
Flags = NDArray[np.bool_]

STEP = 30 * 86400.0
"""Step that is the clock's, s: nobody lets a device run a month between two samples."""

UNIX = 1e9
"""Times from here on are those since 1970: as time since a start, 31 years."""


class ClockStep(NamedTuple):
    """A step of the device's clock.

    Attributes
    ----------
    at_s : time of the first sample behind it, s, as the session has it
    by_s : what the clock jumped by, s

    """

    at_s: float
    by_s: float

    def sentence(self) -> str:
        """Say it for the operator."""
        text = f"at {self.at_s:.3f} s the device's clock jumps by {self.by_s:+.3f} s"
        then = self.at_s + self.by_s
        if UNIX <= then < 4 * UNIX:
            text += f", to {datetime.fromtimestamp(then, UTC):%Y-%m-%d %H:%M} UTC"
        return (
            f"{text}: no time that passed, so the times behind it go on from those"
            " before; how long it took is not known"
        )


class SteadyClock:
    """Takes steps out of times, block by block.

    A step lasts: where one time alone is far from those around it, that row is wrong,
    not the clock, and is left to whoever judges rows.

    Attributes
    ----------
    steps : those found so far

    """

    def __init__(self) -> None:
        self.steps: list[ClockStep] = []
        self._offset = 0.0
        self._last = self._period = np.nan
        self._held = concat([])

    def add(self, block: Block) -> Block:
        """Return the rows of which the times are known, in order."""
        block = concat([self._held, block]) if len(self._held) else block
        known = np.flatnonzero(np.isfinite(block.t))
        times = block.t[known]
        far = np.abs(np.diff(times, prepend=self._last)) > STEP
        keep = len(block)
        if len(known) and far[-1]:
            # whether it lasts, only the row behind it can tell
            keep = int(known[-1])
            times, far = times[:-1], far[:-1]
        self._held = block[keep:]
        return self._steadied(block[:keep], known[: len(times)], times, far)

    def rest(self) -> Block:
        """Return the rows that were held back: the last, of which nothing follows."""
        held, self._held = self._held, concat([])
        far = len(held) and abs(held.t[0] - self._last) > STEP
        if far and np.isfinite(self._period):
            self._step_to(float(held.t[0]))
        return replace(held, t=held.t + self._offset)

    def _steadied(self, block: Block, known: Index, times: Array, far: Flags) -> Block:
        steps = np.diff(times)
        usual = steps[(steps > 0) & (steps <= STEP)]
        if len(usual):
            self._period = float(np.median(usual))
        offsets = np.full(len(block), self._offset)
        edges = [0, *np.flatnonzero(far).tolist(), len(times)]
        for first, end in pairwise(edges):
            if first == end:
                continue
            began = times[first]
            lasts = end > first + 1 and times[first + 1] > began
            if abs(began - self._last) > STEP and lasts and np.isfinite(self._period):
                self._step_to(float(began))
                offsets[known[first] :] = self._offset
            if not abs(began - self._last) > STEP or lasts:
                self._last = float(times[end - 1])
        return replace(block, t=block.t + offsets) if offsets.any() else block

    def _step_to(self, began: float) -> None:
        """Let the times from `began` on go on behind the last."""
        at = self._last + self._offset + self._period
        self.steps.append(ClockStep(at, began - self._last))
        self._offset = at - began


class SteadyTimes(NamedTuple):
    """Times of a recording whose clock was set while it ran.

    Attributes
    ----------
    block : the samples, without the steps of the clock
    steps : those found
    pieces : first and last time as recorded between steps, and what was added, (k, 3) s

    """

    block: Block
    steps: list[ClockStep]
    pieces: Array

    def moved(self, t: float) -> float:
        """What became of an instant as recorded, s."""
        first, last, added = self.pieces.T
        away = np.maximum(np.maximum(first - t, t - last), 0.0)
        return t + float(added[int(np.argmin(away))])


def steadied(block: Block) -> SteadyTimes | None:
    """Take the steps of the clock out of a whole recording; None if there are none.

    Where most times are so far apart, they are in another unit than seconds.
    """
    far = np.abs(np.diff(block.t)) > STEP
    if not 0 < far.sum() < len(far) / 2:
        return None
    clock = SteadyClock()
    whole = concat([clock.add(block), clock.rest()])
    if not clock.steps:
        return None
    added = whole.t - block.t
    edges = np.flatnonzero(np.abs(np.diff(added)) > STEP / 2) + 1
    first, last = np.r_[0, edges], np.r_[edges, len(added)] - 1
    pieces = np.column_stack([block.t[first], block.t[last], added[first]])
    return SteadyTimes(whole, clock.steps, pieces)
