"""Validation of imported samples: bad rows are refused, or left out and said.

A row is refused whose time is not later than that of the row before, whose numbers are
infinite or larger than any sensor's, or which holds nothing but zeros (a buffer that
was never filled): a missing value is no zero. Rows without any number are no samples,
and are left out as if they were not there. A row that repeats the one before, time and
values, was written several times: it is taken once, which is said.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.errors import InputError
from fieldcal.core.samples import CHANNELS, Block, Index, concat, runs_of_true
from fieldcal.importing.recording import MAX_LISTED_FAULTS, MAX_READING
from fieldcal.importing.times.repeats import repeats

Rows = NDArray[np.bool_]

MIN_FALLING_ROWS = 10
"""Number of rows from which times that only fall show a file written newest first."""

MAX_LEFT_OUT, MIN_LONG_ROWS = 0.5, 50
"""Share of rows that may be left out, and rows from which it counts: of a longer file
with more bad rows, the rest is no recording."""


class RowValidator:
    """Validates rows block by block, whatever the blocks.

    The last row with a time is held back until the next one is known, which tells
    whether its time leaps ahead.

    Parameters
    ----------
    name : of the file, for errors
    place : names a row, counted from 0
    repair : whether bad rows are left out and said, or refused

    Attributes
    ----------
    left_out : bad rows that were left out
    repeated : rows that were written several times, taken once

    """

    def __init__(self, name: str, place: Callable[[int], str], repair: bool) -> None:
        self._name, self._place, self._repair = name, place, repair
        self._seen, self._newest, self._before = 0, -np.inf, -np.inf
        self._held, self._held_row = concat([]), -1
        self._runs: list[tuple[str, str, int, int]] = []
        self._more = [0, 0]
        self._first_repeated, self._counted_again = -1, 0.0
        self.left_out = self.repeated = 0

    @property
    def says(self) -> list[str]:
        """What the user must know of rows that are no fault, a sentence each."""
        if not self.repeated:
            return []
        many = f" ({self.repeated} such rows)" if self.repeated > 1 else ""
        return [
            f"{self._place(self._first_repeated)}: repeats the row above, time and"
            f" values{many}: what was written several times is taken once"
        ]

    @property
    def mended(self) -> list[str]:
        """Rows left out, a sentence for each run."""
        says = [self._sentence(*run) for run in self._runs[:MAX_LISTED_FAULTS]]
        if len(self._runs) > MAX_LISTED_FAULTS:
            places, rows = (
                self._more[0] + 1,
                self._more[1] + self._runs[MAX_LISTED_FAULTS][3],
            )
            says.append(f"{rows} more rows in {places} more places")
        return [f"{sentence}, left out" for sentence in says]

    def through(self, blocks: Iterable[Block]) -> Iterator[Block]:
        """Yield the rows that can be used.

        Raises
        ------
        InputError
            For the first row that cannot, where no repair was asked for; names file,
            row and column. Also for a file that leaving rows out does not mend.

        """
        for block in blocks:
            yield self.feed(block)
        if len(last := self.rest()):
            yield last

    def rest(self) -> Block:
        """Return the last row, where no block follows.

        Raises
        ------
        InputError
            As `through` does.

        """
        held, self._held = self._held, concat([])
        if len(held):
            held = self._of_time_order(held, np.array([self._held_row]), np.inf)
        if self.left_out > MAX_LEFT_OUT * max(self._seen, MIN_LONG_ROWS):
            raise InputError(
                f"{self._name}: {self.left_out} of {self._seen} rows cannot be used"
                f" ({self._sentence(*self._runs[0])}): mend the file itself, or name"
                " its columns and their units by --columns and --time-unit"
            )
        return held

    def feed(self, block: Block) -> Block:
        """Return the rows that can be used, up to the last one with a time.

        Raises
        ------
        InputError
            As `through` does.

        """
        bad = np.zeros(len(block), dtype=bool)
        for column, what, rows in self._faults(block):
            self._note(column, what, self._seen + np.flatnonzero(rows & ~bad))
            bad |= rows
        self._leave_out(int(bad.sum()))
        # of what has no value, the time does not matter: it may be another clock's
        usable = ~(bad | _without_numbers(block))
        kept = np.flatnonzero(usable)
        if len(kept):
            numbers = np.append(self._held_row, self._seen + kept)
            whole = block if len(kept) == len(block) else _rows_of(block, usable)
            if len(self._held):
                whole = concat([self._held, whole])
            else:
                numbers = numbers[1:]
            whole, numbers = self._without_repeats(whole, numbers)
            self._held, self._held_row = whole[-1:], int(numbers[-1])
            following = float(whole.t[-1])
            whole = self._of_time_order(whole[:-1], numbers[:-1], following)
        else:
            whole = block[:0]
        self._seen += len(block)
        return whole

    def _without_repeats(self, block: Block, numbers: Index) -> tuple[Block, Index]:
        """Rows, and their numbers in the file, without those that repeat the last.

        A counter that counted them as well is set back: no sample is missing there.
        """
        again = repeats(block)
        block = self._with_counter(block, again)
        if not again.any():
            return block, numbers
        if not self.repeated:
            self._first_repeated = int(numbers[np.argmax(again)])
        self.repeated += int(again.sum())
        return _rows_of(block, ~again), numbers[~again]

    def _with_counter(self, block: Block, again: Rows) -> Block:
        """Rows whose counter does not count those that repeat the last."""
        if not np.isfinite(block.seq).any():
            return block
        seq = block.seq.copy()
        # the row that was held back is set back already
        seq[len(self._held) :] -= self._counted_again
        counted = np.cumsum(again & (np.diff(seq, prepend=np.nan) > 0))
        self._counted_again += float(counted[-1])
        return replace(block, seq=seq - counted)

    def _leave_out(self, count: int) -> None:
        """Count bad rows; refuse them where no repair was asked for."""
        if count and not self._repair:
            raise InputError(
                f"{self._name}: {self._sentence(*self._runs[0])}; mend the file, or"
                " leave such rows out with --repair"
            )
        self.left_out += count

    def _faults(self, block: Block) -> Iterator[tuple[str, str, Rows]]:
        empty = _all_zero(block)
        if empty.any():
            columns = " ".join(
                CHANNELS if np.isfinite(block.gyr).any() else CHANNELS[:3]
            )
            later = self._seen + np.arange(len(block)) > 0
            unstamped = empty & (block.t == 0) & later
            yield f"t {columns}", "hold only zeros", unstamped
            yield columns, "hold only zeros", empty & ~unstamped
        timeless = ~np.isfinite(block.t)
        if timeless.any():
            yield "t", "is no time", timeless
        for names, triad in ((CHANNELS[:3], block.acc), (CHANNELS[3:], block.gyr)):
            wild = np.abs(triad) > MAX_READING
            if wild.any():
                infinite = np.isinf(triad)
                for what, rows in (
                    ("is infinite", infinite),
                    ("is larger than any sensor's", wild & ~infinite),
                ):
                    for i in np.flatnonzero(rows.any(axis=0)):
                        yield names[i], what, rows[:, i]

    def _of_time_order(self, block: Block, numbers: Index, following: float) -> Block:
        """Rows later than all good ones before them, and not ahead of those behind.

        `numbers` (n,) are theirs in the file, `following` is the time of the next row.
        """
        t = block.t
        steps = np.diff(t, append=following)
        if len(t) >= MIN_FALLING_ROWS and (np.diff(t) < 0).all():
            raise InputError(
                f"{self._name}: its times fall from row to row from"
                f" {self._place(int(numbers[0]))} on: it is written newest first; sort"
                " its rows by their time; or, if a timer counts down in it, name that"
                " column -t in --columns"
            )
        before, self._before = self._before, float(t[-1]) if len(t) else self._before
        if len(t) and self._newest < t[0] and (steps > 0).all():
            self._newest = float(t[-1])
            return block
        # one time that leaps ahead is wrong itself, not all that come after it
        behind = np.append(t, following)[1:]
        ahead = (t > behind) & (behind > np.append(before, t)[:-1])
        newest = np.maximum.accumulate(
            np.append(self._newest, np.where(ahead, -np.inf, t))
        )
        late = ~ahead & (t <= newest[:-1])
        self._newest = float(newest[-1])
        bad = np.flatnonzero(late | ahead)
        for run in np.split(bad, np.flatnonzero(np.diff(ahead[bad])) + 1):
            what = (
                "is later than below" if ahead[run].any() else "is not later than above"
            )
            self._note("t", what, numbers[run])
        self._leave_out(int((late | ahead).sum()))
        return _rows_of(block, ~(late | ahead))

    def _note(self, column: str, what: str, rows: Index) -> None:
        """Note a fault of some rows, by their numbers in the file, ascending."""
        ends = np.flatnonzero(np.diff(rows) > 1) + 1
        for run in np.split(rows, ends) if len(rows) else ():
            first, count = int(run[0]), len(run)
            if self._runs:
                *same, begin, n = self._runs[-1]
                if same == [column, what] and begin + n == first:
                    self._runs[-1] = (column, what, begin, n + count)
                    continue
            if len(self._runs) > MAX_LISTED_FAULTS:
                # of a log that is bad all over, only the number of its faults is kept
                self._more[0] += 1
                self._more[1] += self._runs.pop()[3]
            self._runs.append((column, what, first, count))

    def _sentence(self, column: str, what: str, first: int, count: int) -> str:
        rows = self._place(first)
        if count > 1:
            rows += f" to {self._place(first + count - 1)}"
        return f"{rows}, column {column}: {what}"


def _rows_of(block: Block, some: Rows) -> Block:
    """Some rows of a block."""
    if some.all():
        return block
    return concat(block[a:b] for a, b in runs_of_true(some).tolist())


def _all_zero(block: Block) -> Rows:
    """Whether rows consist of zeros only; missing rates are ignored."""
    empty: Rows = block.acc[:, 0] == 0
    some = np.flatnonzero(empty)
    zeros = (block.acc[some] == 0).all(axis=1)
    empty[some] = zeros & ((block.gyr[some] == 0) | np.isnan(block.gyr[some])).all(
        axis=1
    )
    return empty


def _without_numbers(block: Block) -> Rows:
    """Whether rows have no value of any sensor."""
    none: Rows = np.isnan(block.acc[:, 0])
    if none.any():
        none &= np.isnan(block.six).all(axis=1) & np.isnan(block.temperature)
    return none
