"""Positions of a recording that contains no turns, only jumps from rest to rest.

    d_i = |median(x_i .. x_(i+4)) - median(x_(i-5) .. x_(i-1))| > 8 s               (1)

x_i are the rows of an accelerometer, and s is the noise of a row, m/s^2. A single
outlier does not change a median. At a jump between two rows (1) is true at five rows,
or at six with an outlier next to it, and the jump is into the row of them that differs
most from the row before; at a recorded turn (1) is true at more rows. In a
rest the first and the last median differ by less than a jump, and the rows have the
same scatter as in other rests; neither holds for a moving device. Such a recording
results if the operator presses a key at each position, and a hundred rows are taken at
each key.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.probability import MAD_TO_SIGMA
from fieldcal.core.samples import Array, Block, concat

MEDIAN_ROWS = 5
"""Rows of a median in (1)."""

JUMP_OVER_NOISE = 8.0
"""Least jump, in units of the noise of a row."""

FEWEST_ROWS, FEWEST_POSITIONS = 20, 3
"""Fewest rows of a position, and fewest positions, of such a recording."""

FEWEST_FACES = 6
"""Positions from which on one of them may not have been at rest."""

LARGEST_SCATTER_RATIO = 5.0
"""Largest ratio of the scatter of rows in one position to that in another."""

LEAST_SHARE = 0.95
"""Least part of the changes that are jumps, and of the positions that are at rest."""


class JumpRows(NamedTuple):
    """Rows where (1) holds, in order.

    Attributes
    ----------
    row, time : of each, (k,)
    before, after : medians before and after it, (k, 3) m/s^2
    steps : sum of the successive differences of all rows up to it, each limited to a
        jump, (k,) m/s^2
    last_step : by how much it differs from the row before, (k,) m/s^2

    """

    row: NDArray[np.intp]
    time: Array
    before: Array
    after: Array
    steps: Array
    last_step: Array

    def some(self, rows: NDArray[np.intp]) -> JumpRows:
        """Those at some indices."""
        return JumpRows(
            self.row[rows], self.time[rows], self.before[rows], self.after[rows],
            self.steps[rows], self.last_step[rows],
        )  # fmt: skip


class JumpFinder:
    """Finds where the rows of a recording jump, block by block."""

    def __init__(self) -> None:
        self._held = concat([])
        self._rows = 0
        self._size = np.full(3, np.nan)
        self._steps = self._least_jump = 0.0
        self._changes: list[JumpRows] = []
        self._begin = self._end = (np.nan, np.full(3, np.nan))

    def add(self, block: Block) -> None:
        """Take in the block that follows."""
        self._rows += len(block)
        block = concat([self._held, block])
        self._held = block[max(len(block) - 2 * MEDIAN_ROWS + 1, 0) :]
        if len(block) < 2 * MEDIAN_ROWS or not np.isfinite(block.acc).any(axis=0).all():
            return
        if np.isnan(self._size).any():
            whole = block.acc[np.isfinite(block.acc).all(axis=1)]
            apart = np.abs(np.diff(whole, axis=0))
            self._size = JUMP_OVER_NOISE * _noise(apart)
            self._least_jump = float(
                np.nan_to_num(_least_jump(apart), posinf=0.0).sum()
            )
        view = np.lib.stride_tricks.sliding_window_view(block.acc, MEDIAN_ROWS, axis=0)
        middle = np.median(view, axis=-1)
        if np.isnan(self._begin[0]):
            self._begin = float(block.t[0]), middle[0]
        self._end = float(block.t[-1]), middle[-1]
        before, after = middle[:-MEDIAN_ROWS], middle[MEDIAN_ROWS:]
        far: NDArray[np.bool_] = np.any(np.abs(after - before) > self._size, axis=1)
        at = np.flatnonzero(far)  # (1)
        row = at + MEDIAN_ROWS + self._rows - len(block)
        step = np.nan_to_num(
            np.abs(np.diff(block.acc[MEDIAN_ROWS - 1 : 1 - MEDIAN_ROWS], axis=0))
        )
        steps = self._steps + np.cumsum(np.minimum(step, self._size).sum(axis=1))
        self._steps = float(steps[-1])
        last_step = np.linalg.norm(step[at], axis=1)
        self._changes.append(
            JumpRows(
                row, block.t[at + MEDIAN_ROWS], before[at], after[at], steps[at],
                last_step,
            )
        )  # fmt: skip

    @property
    def positions(self) -> list[tuple[float, float]]:
        """Start and end of each position, s; empty for a recording of another kind."""
        if not self._changes:
            return []
        changes = JumpRows(*map(np.concatenate, zip(*self._changes, strict=True)))
        if not len(changes.row):
            return []
        parts = np.flatnonzero(np.diff(changes.row) > 1) + 1
        first, last = np.append(0, parts), np.append(parts, len(changes.row)) - 1
        if np.mean(last - first <= MEDIAN_ROWS) < LEAST_SHARE:
            return []
        begins = np.vstack([self._begin[1], changes.after[last]])
        closes = np.vstack([changes.before[first], self._end[1]])
        rests = (np.abs(closes - begins) <= self._size).all(axis=1)
        largest = [
            a + np.argmax(changes.last_step[a : b + 1])
            for a, b in zip(first, last, strict=True)
        ]
        into = np.array(largest, dtype=np.intp)
        return self._spans(changes.some(into), rests)

    def _spans(
        self, jumps: JumpRows, rests: NDArray[np.bool_]
    ) -> list[tuple[float, float]]:
        """Start and end of each position, s, given the rows at which they begin."""
        time = jumps.time
        rows = np.diff(np.concatenate([[0], jumps.row, [self._rows]]))
        long = rows >= FEWEST_ROWS
        held, moved = rests[long].sum(), (~rests[long]).sum()
        # of all faces, one may have been nudged while it was held
        most = max((1 - LEAST_SHARE) * long.sum(), held >= FEWEST_FACES - 1)
        if held < FEWEST_POSITIONS or moved > most:
            return []
        differ = np.diff(np.concatenate([[0.0], jumps.steps, [self._steps]])) / rows
        quiet = max(float(differ[long].min()), self._least_jump)
        if (differ[long] > LARGEST_SCATTER_RATIO * quiet).mean() > 1 - LEAST_SHARE:
            return []
        starts = np.append(self._begin[0], time)
        ends = np.append(time, self._end[0])
        # a position ends with the last row before the next
        ends[:-1] -= ((ends - starts) / rows)[:-1]
        return list(zip(starts[long].tolist(), ends[long].tolist(), strict=True))


def _least_jump(step: Array) -> Array:
    """Least nonzero step, (3,); inf where there is none."""
    least: Array = np.where(step > 0, step, np.inf).min(axis=0, initial=np.inf)
    return least


def _noise(step: Array) -> Array:
    """Standard deviation of a row, from steps (n, 3); at least the resolution."""
    if not len(step):
        return np.full(3, np.nan)
    usual = MAD_TO_SIGMA * np.median(step, axis=0) / np.sqrt(2)
    least = _least_jump(step)
    noise: Array = np.maximum(usual, np.where(np.isfinite(least), least, 0.0))
    return noise
