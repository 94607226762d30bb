"""Questions about the times of a recording in columns, with what it says itself."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from shlex import quote
from typing import NamedTuple

import numpy as np

from fieldcal.core.samples import CHANNELS, Array
from fieldcal.importing.columns import SKIP
from fieldcal.importing.read_options import ReadOptions, RowBatch, seconds_in
from fieldcal.importing.times.row_times import CLOCK_PARTS, FRACTIONS, NEAR_STEPS
from fieldcal.importing.units.gravity_size import estimate_gravity
from fieldcal.importing.units.rate_size import estimate_rate_unit
from fieldcal.importing.units.scales import MIN_ROWS, counts_beside, rounded_text
from fieldcal.importing.units.shared_times import (
    SHARED,
    SharedTimes,
    shared_times,
    time_units_of_bursts,
)
from fieldcal.importing.units.time_units import (
    UNIX,
    possible_time_units,
)

MIN_RATE_HZ, USUAL_RATE_HZ, MAX_RATE_HZ = 5.0, 100.0, 8000.0
"""Rates of logs, Hz."""


COARSEST = 1.001
"""Step of the coarsest clock, s."""

LATER = 0.999
"""Share of rows that are later than the row before, of a clock: one may be damaged."""

SET_BACK = 0.01
"""Share of steps back, of a clock that is set now and then; a fraction has more."""

FRACTION_NAMES = tuple(sorted(FRACTIONS, key=lambda name: -FRACTIONS[name]))
"""Columns of fractions of a second, the coarsest first."""


REACHED = 0.5
"""Part of a second that what is beyond whole seconds reaches at least: the parts of a
frame that are counted do not."""


class SplitSeconds(NamedTuple):
    """A clock in two columns.

    Attributes
    ----------
    whole, fraction : numbers of the columns
    name : what the second is called, of `FRACTIONS`

    """

    whole: int
    fraction: int
    name: str


def split_seconds(table: Array, wholes: Iterable[int]) -> SplitSeconds | None:
    """Two columns of (n, k) that are a clock together; None if no two are.

    One holds whole seconds, the other what is beyond them, and both together only grow.

    Parameters
    ----------
    table : (n, k) first rows
    wholes : numbers of the columns that may hold the seconds

    """
    if len(table) < MIN_ROWS:
        return None
    for i in wholes:
        seconds = table[:, i]
        steps = np.diff(seconds)
        if not np.isfinite(steps).all() or (steps != np.round(steps)).any():
            continue
        if not (steps == 1).any() or (steps == 0).mean() < 0.5:
            continue
        for j in range(table.shape[1]):
            part = table[:, j]
            name = next((f for f in FRACTION_NAMES
                         if np.max(part) * FRACTIONS[f] < 1), "")  # fmt: skip
            if i == j or not name or np.min(part) < 0 or np.ptp(part) == 0:
                continue
            if np.max(part) * FRACTIONS[name] < REACHED:
                continue
            if (np.diff(part)[steps == 1] < 0).mean() < LATER:
                continue
            if not _fills_second(part, steps, FRACTIONS[name]):
                continue
            both = np.diff(seconds + part * FRACTIONS[name])
            # within a minute the seconds begin again
            if (both > 0).mean() > LATER - (steps < 0).mean():
                return SplitSeconds(i, j, name)
    return None


def _fills_second(part: Array, steps: Array, size: float) -> bool:
    """Whether a fraction (n,) runs on to the end of each second.

    A number of the rows of each of several pieces grows and begins again as well, but
    ends anywhere: 0 to 127 are no milliseconds.

    Parameters
    ----------
    part : the fractions
    steps : (n - 1) s, of the whole seconds
    size : s, of one in `part`

    """
    ends = part[:-1][steps == 1] * size
    usual = float(np.median(np.diff(part)[steps == 0])) * size
    return bool(np.median(ends) + NEAR_STEPS * usual > 1)


def is_clock_number(t: Array) -> bool:
    """Whether times (n,) hold hours, minutes and seconds in one number: 142031.5.

    >>> is_clock_number(np.r_[142058:142060:0.5, 142100:142102:0.5])
    True

    Such numbers leave out 40 at the end of each minute, where a count goes on evenly.

    >>> is_clock_number(np.arange(0.0, 3100.0, 50.0))
    False
    """
    t = t[np.isfinite(t)]
    begins = np.flatnonzero(np.diff(np.floor(t / 100)) > 0)
    if not len(begins) or not (t >= 0).all() or t.max() >= 240000:
        return False
    inside = (t % 100 < 60).all() and (np.floor(t / 100) % 100 < 60).all()
    ends = (t[begins] % 100, t[begins + 1] % 100)
    usual = float(np.median(np.diff(t)))
    left_out = float(np.median(np.diff(t)[begins])) - usual
    return bool(inside and usual > 0 and left_out > 20
                and (60 - ends[0] < NEAR_STEPS * usual).all()
                and (ends[1] < NEAR_STEPS * usual).all())  # fmt: skip


def batch_options(
    wanted: ReadOptions, shared: SharedTimes, t: Array
) -> ReadOptions | None:
    """Options that spread rows with shared times (n,); None if ambiguous.

    A second is the coarsest clock, and beyond it rows are bursts with pauses between,
    also in a unit in which the rows of one have the rate of a log.
    """
    t = t[np.isfinite(t)]
    own = [] if shared.equal else time_units_of_bursts(t)
    if any(shared.step * seconds_in(unit) > COARSEST for unit in own):
        return None
    each = np.linspace(t[0], t[-1], len(t))  # as if every row had its own
    unit = wanted.time_unit or next(iter(possible_time_units(each)), "s")
    seconds = shared.step * seconds_in(unit)
    if not shared.even or seconds > COARSEST or shared.rows < len("12"):
        return None
    return replace(wanted, time_unit=unit, batch=RowBatch(seconds, shared.rows))


def ask_rate_of_shared_times(wanted: ReadOptions, shared: SharedTimes, t: Array) -> str:
    """Ask for the rate where rows share times (n,), now more, now fewer."""
    unit = wanted.time_unit or next(iter(possible_time_units(t)), "s")
    rate = shared.rows / (shared.step * seconds_in(unit))
    names = _without_times(wanted)
    return (
        f"its times step by {shared.step:g} {unit}, with about {shared.rows:.0f} rows"
        " in each, so they do not say when a row was taken: add --columns"
        f" {quote(','.join(names))} --rate {rounded_text(rate)}"
    )


def _without_times(wanted: ReadOptions) -> list[str]:
    """Columns as ``--columns`` names them, without those of the time."""
    pairs = [name.partition("=") for name in wanted.columns]
    return [
        SKIP if channel in ("t", *CLOCK_PARTS) else channel + sign + place
        for channel, sign, place in pairs
        if not (place and channel in ("t", *CLOCK_PARTS))
    ]


def ask_rate_of_counter(wanted: ReadOptions, table: Array) -> str:
    """Ask for the rate where the times only count the rows."""
    names = _without_times(wanted)
    return (
        "its times grow by 1 from row to row, so they may count rows: add --columns"
        f" {quote(','.join(names))} --rate {rate_hint(wanted, table)}; or --time-unit s"
        " if a row is taken each second, or --time-unit ms if each ms"
    )


def rate_hint(wanted: ReadOptions, table: Array) -> str:
    """Rates that the turns imply, for messages: for counts, one for each full scale."""
    turns = rates_by_turns(wanted, table)
    if not turns:
        return f"{USUAL_RATE_HZ:.3g}"
    (unit, rate), *others = turns.items()
    hint = f"{rounded_text(rate)}, which its turns say about, if rates are in {unit}"
    if unit.startswith("counts"):
        hint += "".join(
            f", or {rounded_text(hz)} if {what.split()[1]}" for what, hz in others
        )
    return hint


def is_row_counter(t: Array) -> bool:
    """Whether times (n,) are only row numbers; seconds since 1970 are none.

    >>> rows = np.arange(100.0)
    >>> is_row_counter(rows), is_row_counter(1.7e9 + rows)
    (True, False)
    """
    t = t[np.isfinite(t)]
    steps = np.diff(t)
    counts = len(steps) > MIN_ROWS and float((steps == 1).mean()) > LATER
    return counts and not UNIX[0] <= t[0] < UNIX[1]


def constant_value(t: Array) -> float | None:
    """The only value of numbers (n,), which are no times then; None of others."""
    known = t[np.isfinite(t)]
    return float(known[0]) if len(known) > 1 and not np.ptp(known) else None


def share_of_one_time(t: Array) -> float:
    """Share of rows (n,) that have the time of the row before; 0 where few have.

    Those of batches, whose times step again and again, are no such rows. Numbers of 32
    bits hold the seconds since 1970 in steps of 128 s.

    >>> share_of_one_time(np.repeat([0.0, 128.0], 51)) > 0.9
    True
    >>> share_of_one_time(np.arange(99.0)), share_of_one_time(np.repeat(range(9), 9))
    (0.0, 0.0)
    """
    steps = np.diff(t[np.isfinite(t)])
    same = float((steps == 0).mean()) if len(steps) >= MIN_ROWS else 0.0
    return same if same > SHARED and shared_times(t) is None else 0.0


def keeps_growing(t: Array) -> bool:
    """Whether times (n,) increase, with few resets."""
    steps = np.diff(t[np.isfinite(t)])
    back = len(steps) < len(t) / 2 or float((steps < 0).mean()) > SET_BACK
    return not back and bool((steps > 0).any())


def grows_each_row(column: Array) -> bool:
    """Whether numbers (n,) keep growing, and not by a late change of the rate."""
    steps = np.diff(column[np.isfinite(column)])
    return keeps_growing(column) and bool((steps > 0).mean() > 0.5)


def falls_each_row(column: Array) -> bool:
    """Whether numbers (n,) fall from row to row, as those of a timer that counts down.

    >>> falls_each_row(60 - np.arange(100) / 50), falls_each_row(np.arange(100.0))
    (True, False)
    """
    steps = np.diff(column[np.isfinite(column)])
    return len(steps) >= MIN_ROWS and float((steps < 0).mean()) > LATER


def turns_in_order(wanted: ReadOptions, table: Array) -> bool:
    """Whether gravity turns as the rates say, if rows (n, k) were taken in order."""
    return _turn_reading(wanted, table) is not None


def rates_by_turns(wanted: ReadOptions, table: Array) -> dict[str, float]:
    """Rates, Hz, at which turns by gyroscopes agree with those by gravity, by unit."""
    turns = _turn_reading(wanted, table)
    if turns is None:
        return {}
    reads, gyr, gravity = turns
    counts = np.isfinite(gyr).all() and (gyr == np.round(gyr)).all()
    fits = {"rad/s": 1.0, "deg/s": float(np.rad2deg(1.0)), "mrad/s": 1e3}
    if wanted.gyr_unit:
        fits = {wanted.gyr_unit: 1 / wanted.gyr_scale}
    elif counts:
        # each full scale would be another rate
        fits = {str(scale): scale.size for scale in counts_beside(gravity)}
    rates = {unit: 100 * reads / one for unit, one in fits.items()}
    sane = {u: rate for u, rate in rates.items() if MIN_RATE_HZ <= rate <= MAX_RATE_HZ}
    if counts:
        # the full scale that a sensor begins with, first
        return sane
    return dict(
        sorted(sane.items(), key=lambda one: abs(np.log(one[1] / USUAL_RATE_HZ)))
    )


def _turn_reading(
    wanted: ReadOptions, table: Array
) -> tuple[float, Array, float] | None:
    """What 1 rad/s reads at 100 Hz, the rates (n, 3), and what gravity reads.

    None if rows (n, k) do not have both sensors, or their turns tell nothing.
    """
    at = {c.partition("=")[0]: i for i, c in enumerate(wanted.columns)}
    if not {*CHANNELS} <= set(at) or table.shape[1] != len(wanted.columns):
        return None
    acc, gyr = (table[:, [at[kind + axis] for axis in "xyz"]] for kind in "ag")
    signs = [[-1.0 if k + x in wanted.reversed else 1.0 for x in "xyz"] for k in "ag"]
    acc, gyr = acc * signs[0], gyr * signs[1]
    gravity = estimate_gravity(acc)
    if gravity is None:
        return None
    clock = np.arange(len(table)) / 100.0
    reads = estimate_rate_unit(clock, acc, gyr, gravity)
    return None if reads is None else (reads, gyr, gravity.size)
