"""Times of the rows of a file, s: from a clock, from steps between rows, or a rate.

A clock may hold whole seconds in one column and what is beyond them in another, the
hours and minutes in one number (``142031.5`` is 14:20:31.5), or count up to where its
bits or the day end and begin again. That of a device that starts again begins anew.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.importing.read_options import CLOCK_NUMBER, ReadOptions, RowBatch

FRACTIONS = {"t_ms": 1e-3, "t_us": 1e-6, "t_ns": 1e-9}
"""Columns that hold what is beyond the whole seconds of ``t``, and s in one of each."""

CLOCK_PARTS = {"t_h": 3600.0, "t_min": 60.0, **FRACTIONS}
"""Columns that are added to the seconds of ``t``, and s in one of each."""

COUNTED = (2.0**16, 2.0**24, 2.0**32)
"""Where counters of a device begin again: at 0, or at minus a half with a sign."""

DIVIDED = tuple(many * tick for many in COUNTED for tick in (1e-6, 1e-3))
"""Likewise of counters of us and ms that a program divides before it writes them, s."""

LONG_PERIOD = 10.0
"""Times that such a period is longer than what is near its end."""

PERIODS = (60.0, 3600.0, 86400.0, 604800.0)
"""Where clocks begin again, s: a minute, an hour, a day, a week."""

SECOND, PART_STEPS = 1.0, 2.0
"""Where parts of a second begin again that are written without it, s, and the usual
steps within which they do: a device may be started again after a second."""

NEAR_STEPS = 20.0
"""Usual steps by which a clock is before its end, and behind its beginning."""


STARTED, BETWEEN = 30.0, 10.0
"""Time since its start within which a device writes its first row, s, and that taken to
have passed while it was started again, s or usual steps."""

PAUSED, PULL = 1.5, 0.05
"""Distances of batches that are a pause, and the part of what one comes late that
those behind it do as well."""


ANEW = (
    ", as where a device is started again: the rows behind follow"
    f" {BETWEEN:g} s later, and what happened between is not used"
)


def clock_numbers(values: Array) -> Array:
    """Seconds since midnight of numbers (n,) such as 142031.5.

    >>> clock_numbers(np.array([142031.5])).tolist()
    [51631.5]
    """
    minutes = np.floor(values / 100)
    since: Array = values % 100 + 60 * (minutes % 100) + 3600 * np.floor(minutes / 100)
    return since


class CoarseTimes:
    """Times of rows of which some have that of the row before: a coarse clock's.

    They go half way to where the clock steps, and the next one half of the rest, so
    that each is as near to the time that the file says as the clock tells.

    >>> CoarseTimes(1.0).of(np.array([0.0, 0.0, 0.0, 1.0, 2.0, 2.0])).tolist()
    [0.0, 0.5, 0.75, 1.0, 2.0, 2.5]

    Parameters
    ----------
    tick : by which the clock steps, s

    """

    def __init__(self, tick: float) -> None:
        self._tick, self._last, self._many = tick, np.nan, 0

    def of(self, t: Array) -> Array:
        """Times (n,) of the next rows, s."""
        same = t == np.concatenate([[self._last], t[:-1]])
        at = np.arange(len(t))
        first = np.maximum.accumulate(np.where(same, -1, at))
        many = at - first
        # those of the piece before go on
        many[first < 0] += self._many
        if len(t):
            self._last, self._many = float(t[-1]), int(many[-1])
        found: Array = t + self._tick * (1 - 0.5**many)
        return found


class BatchTimes:
    """Times of rows that share those of their batch, spread evenly over it.

    Each row is later than the one before by what it is on average; a batch that comes
    early or late moves this a little, and one that comes after a pause anew.

    Parameters
    ----------
    batch : how far batches are from each other, and how many rows they have

    """

    def __init__(self, batch: RowBatch) -> None:
        self._step, self._long = batch.seconds / batch.rows, PAUSED * batch.seconds
        self._last, self._next = -np.inf, -np.inf

    def of(self, t: Array) -> Array:
        """Times (n,) of the next rows, of which those of a batch have one, s."""
        step, spread = self._step, np.empty(len(t))
        known = np.where(np.isfinite(t), t, -np.inf)
        before = np.concatenate([[self._last], known[:-1]])
        begins = known - before > step / 2
        edges = np.unique([0, *np.flatnonzero(begins), len(t)])
        for first, last in pairwise(edges):
            if begins[first] and known[first] - self._next > self._long:
                # the first one may be cut off: what is whole begins with the next
                own = known[first : last + 1]
                behind = own[-1] - step * (last - first)
                whole = last < len(t) and own[-1] - own[0] < self._long
                self._next = max(float(behind if whole else own[0]), self._next)
            elif begins[first]:
                late = float(known[first]) - self._next
                self._next += max(PULL * late, -step / 2)
            spread[first:last] = self._next + step * np.arange(last - first)
            self._next += step * (last - first)
        self._last = float(known[-1]) if len(t) else self._last
        return np.where(np.isfinite(t), spread, np.nan)


class RowTimes:
    """Makes times, block by block.

    Parameters
    ----------
    wanted : unit of times, and the rate where no column holds them

    Attributes
    ----------
    says : what the user must know, a sentence for each time a clock began again

    """

    def __init__(self, wanted: ReadOptions) -> None:
        self._wanted, self.says = wanted, list[str]()
        self._seen, self._sum, self._offset = 0, 0.0, 0.0
        self._earlier = self._last = self._usual = np.nan
        self._anew: list[float] = []
        self._began = np.nan
        self._unsure: tuple[float, float] | None = None
        self._spread: BatchTimes | CoarseTimes | None = None
        if wanted.batch:
            self._spread = BatchTimes(wanted.batch)
        elif wanted.tick:
            self._spread = CoarseTimes(wanted.tick * wanted.time_scale)

    def of(self, columns: Mapping[str, Array], n: int) -> Array:
        """Times (n,) of the next rows."""
        scale = self._wanted.time_scale
        self._seen += n
        if "t" in columns:
            t = self._of_clock(columns["t"], columns, scale)
            return t if self._spread is None else self._spread.of(t)
        if "dt" in columns:
            passed = np.cumsum(np.nan_to_num(columns["dt"])) * scale + self._sum
            self._sum = float(passed[-1]) if n else self._sum
            return passed
        first = self._seen - n
        return (first + np.arange(n)) / (self._wanted.rate_hz or 1.0)

    def _of_clock(
        self, values: Array, columns: Mapping[str, Array], scale: float
    ) -> Array:
        if self._wanted.time_unit == CLOCK_NUMBER:
            values = clock_numbers(values)
        t: Array = values * scale
        for name, size in CLOCK_PARTS.items():
            if name in columns:
                t = t + columns[name] * size
        t = -t if "t" in self._wanted.reversed else t
        known = np.flatnonzero(np.isfinite(t))
        if len(known):
            self._began = float(t[known[0]]) if np.isnan(self._began) else self._began
            self._decide(float(t[known[0]]))
        earlier = np.concatenate([[self._earlier, self._last], t[known]])
        steps = np.diff(earlier[1:])
        forward = steps[steps > 0]
        self._usual = float(np.median(forward)) if len(forward) else self._usual
        offsets = np.full(len(t), self._offset)
        for i in np.flatnonzero(steps < 0).tolist():
            began = float(t[known[i]])
            if began > earlier[i]:
                continue  # it is the time before that leaps, by itself
            before = began - steps[i]
            period = self._period(before, began, scale)
            if not period and _lasts(t[known[i : i + 2]], before):
                period = self._started(before, began)
                if period and i + 1 == len(known):
                    self._unsure = before, period
            offsets[known[i] :] += period
            self._offset += period
        self._earlier, self._last = earlier[-2:].tolist()
        t = t + offsets
        return t

    def _decide(self, following: float) -> None:
        """Take a start back that the last row of a block alone showed, if it was none.

        A time that goes on from the one before that row shows that it was a wrong one.
        """
        if self._unsure is not None and following > self._unsure[0]:
            self._last, self._earlier = self._unsure[0], np.nan
            self._offset -= self._unsure[1]
            self._anew.pop()
            self._say_starts()
        self._unsure = None

    def _period(self, before: float, began: float, scale: float) -> float:
        """Where a clock began again that went from one time to another; 0 if not."""
        near = NEAR_STEPS * self._usual
        own = [many * scale for many in COUNTED]
        # of a period of few steps any time is near both ends
        counted = own + [p for p in DIVIDED if p > LONG_PERIOD * near]
        signed = [(-p / 2, p) for p in counted]
        unsigned = [(0.0, p) for p in (*counted, *PERIODS)]
        if LONG_PERIOD * PART_STEPS * self._usual < SECOND:
            unsigned.append((0.0, SECOND))
        for low, period in (*unsigned, *signed):
            within = PART_STEPS * self._usual if period == SECOND else near
            if 0 <= began - low < within and 0 < low + period - before < within:
                said = (
                    f"its clock ends at {low + period:g} s and begins again"
                    f"{f' at {low:g} s' if low else ''}: the times behind go on"
                )
                self.says += [said] if said not in self.says else []
                return period
        return 0.0

    def _started(self, before: float, began: float) -> float:
        """From the zero of a clock to that of its next start, s; 0 if there is none."""
        if not 0 <= began < STARTED or before - began < NEAR_STEPS * self._usual:
            return 0.0
        self._anew.append(before + self._offset)
        self._say_starts()
        return before - began + max(BETWEEN, BETWEEN * self._usual)

    def _say_starts(self) -> None:
        """Say where the clock began anew, in one sentence."""
        self.says[:] = [one for one in self.says if not one.endswith(ANEW)]
        if self._anew:
            first, *others = self._anew
            many = "once" if len(others) == 1 else f"{len(others)} times"
            again = f" (and {many} more)" if others else ""
            where = f"{first - self._began:.4g} s behind its first row"
            self.says.append(f"its clock begins anew {where}{again}{ANEW}")


def _lasts(t: Array, before: float) -> bool:
    """Whether a time is followed by one behind it, if by any, and not as before."""
    return len(t) == 1 or bool(t[0] < t[1] < before)
