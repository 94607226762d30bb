"""Removes steps of a device's clock from the times of a recording.

A device counts time from its start until a receiver or a host sets its clock. Its times
then jump by some fifty years while the samples continue. Such a step is removed and
kept as a mark: the first time after it follows the last one before it by one period.
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

LEAST_STEP = 30 * 86400.0
"""Least difference of successive times that counts as a step of the clock, s."""

LEAST_UNIX_TIME = 1e9
"""Least time that is taken for seconds since 1970, s."""


class ClockStep(NamedTuple):
    """A step of the device's clock.

    Attributes
    ----------
    at_s : corrected time of the first sample after the step, s
    by_s : size of the step, s

    """

    at_s: float
    by_s: float

    def sentence(self) -> str:
        """Sentence for the operator."""
        text = f"at {self.at_s:.3f} s the device's clock jumps by {self.by_s:+.3f} s"
        then = self.at_s + self.by_s
        if LEAST_UNIX_TIME <= then < 4 * LEAST_UNIX_TIME:
            text += f", to {datetime.fromtimestamp(then, UTC):%Y-%m-%d %H:%M} UTC"
        return (
            f"{text}: no time that passed, so the times behind it go on from those"
            " before; how long it took is not known"
        )


class ClockStepRemover:
    """Removes steps from times, block by block.

    After a step all later times are shifted. A single time far from its neighbours is
    an error of that row and is kept.

    Attributes
    ----------
    steps : those found so far

    """

    def __init__(self) -> None:
        self.steps: list[ClockStep] = []
        self._pieces: list[tuple[float, float, float]] = []
        self._offset = 0.0
        self._last = self._period = np.nan
        self._held = concat([])

    def add(self, block: Block) -> Block:
        """Return rows with corrected times; the last row may wait for the next call."""
        block = concat([self._held, block]) if len(self._held) else block
        known = np.flatnonzero(np.isfinite(block.t))
        times = block.t[known]
        far = np.abs(np.diff(times, prepend=self._last)) > LEAST_STEP
        keep = len(block)
        if len(known) and far[-1]:
            # only the next row shows whether this is a step or a single wrong time
            keep = int(known[-1])
            times, far = times[:-1], far[:-1]
        self._held = block[keep:]
        return self._steadied(block[:keep], known[: len(times)], times, far)

    def flush(self) -> Block:
        """Return the rows that were held back, at the end of the recording."""
        held, self._held = self._held, concat([])
        far = len(held) and abs(held.t[0] - self._last) > LEAST_STEP
        if far and np.isfinite(self._period):
            self._step_to(float(held.t[0]))
        return replace(held, t=held.t + self._offset)

    def corrected(self, t: float) -> float:
        """Corrected time of a recorded time, s: that of the nearest piece so far."""
        if not self._pieces:
            return t
        first, last, added = np.array(self._pieces).T
        away = np.maximum(np.maximum(first - t, t - last), 0.0)
        return t + float(added[int(np.argmin(away))])

    def _steadied(self, block: Block, known: Index, times: Array, far: Flags) -> Block:
        steps = np.diff(times)
        usual = steps[(steps > 0) & (steps <= LEAST_STEP)]
        if len(usual):
            self._period = float(np.median(usual))
        offsets = np.full(len(block), self._offset)
        edges = [0, *np.flatnonzero(far).tolist(), len(times)]
        for first, end in pairwise(edges):
            if first == end:
                continue
            began = times[first]
            lasts = end > first + 1 and times[first + 1] > began
            if (
                abs(began - self._last) > LEAST_STEP
                and lasts
                and np.isfinite(self._period)
            ):
                self._step_to(float(began))
                offsets[known[first] :] = self._offset
            if not abs(began - self._last) > LEAST_STEP or lasts:
                self._last = float(times[end - 1])
                first_s = self._pieces.pop()[0] if self._pieces else float(began)
                self._pieces.append((first_s, self._last, self._offset))
        return replace(block, t=block.t + offsets) if offsets.any() else block

    def _step_to(self, began: float) -> None:
        """Shift the times from `began` on to follow the last time."""
        at = self._last + self._offset + self._period
        self.steps.append(ClockStep(at, began - self._last))
        self._offset = at - began
        self._pieces.append((began, began, self._offset))


def remove_clock_steps(block: Block) -> tuple[Block, ClockStepRemover] | None:
    """Remove the steps of the clock from a whole recording; None if there are none.

    If most differences are that large, the times are in another unit than s, and None
    is returned.
    """
    far = np.abs(np.diff(block.t)) > LEAST_STEP
    if not 0 < far.sum() < len(far) / 2:
        return None
    clock = ClockStepRemover()
    whole = concat([clock.add(block), clock.flush()])
    return (whole, clock) if clock.steps else None
