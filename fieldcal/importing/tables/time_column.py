"""The column of times: its unit, its steps, and rows that share one time.

It may count ticks or rows, fall, or hold hours and minutes in one number. What only the
user can know is asked.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.importing import columns
from fieldcal.importing.read_options import CLOCK_NUMBER, ReadOptions
from fieldcal.importing.tables.column_source import ColumnSource, column_numbers
from fieldcal.importing.tables.column_times import (
    ask_rate_of_counter,
    ask_rate_of_shared_times,
    batch_options,
    constant_value,
    falls_each_row,
    is_clock_number,
    is_row_counter,
    share_of_one_time,
    turns_in_order,
)
from fieldcal.importing.times.repeats import NO_VALUES, distinct_rows
from fieldcal.importing.times.row_times import CLOCK_PARTS, FRACTIONS
from fieldcal.importing.units.shared_times import (
    coarse_tick,
    shared_times,
)
from fieldcal.importing.units.time_units import (
    RATE_TOLERANCE,
    TICKED,
    counts_from_long_ago,
    tick_at_rate,
    time_unit_near_rate,
    time_unit_of_rate,
    time_unit_of_ticks,
)

TICK = "fine"
"""Part of the name of times that count ticks: ``SampleTimeFine``."""


BOSCH = ("sensortime", "39.0625us")
"""Name of the counter of sensors by Bosch, and what it counts."""


class TimeColumn:
    """Finds what the times of one IMU are.

    Parameters
    ----------
    source : the file
    own : whether the columns are those that the file says

    """

    def __init__(self, source: ColumnSource, own: bool) -> None:
        self._of, self._own = source, own

    def settled(self, wanted: ReadOptions) -> ReadOptions:
        """Options with the unit of times, where the rate or their name tells it.

        Raises
        ------
        InputError
            If its times are too coarse to say when a row was taken, or none.

        """
        table, at = self._of.beginning(), column_numbers(self._of, wanted)
        i = at.get("t", -1)
        if not 0 <= i < table.shape[1]:
            return wanted
        if wanted.reversed.isdisjoint("t") and self._counts_down(wanted, table, i):
            wanted = replace(wanted, reversed=wanted.reversed | {"t"})
        if "t" in wanted.reversed:
            table = np.where(np.arange(table.shape[1]) == i, -table, table)
        # of rows that were written several times, each counts once
        no_values = (columns.SKIP, *NO_VALUES)
        wanted_too = (j for name, j in at.items() if name not in no_values)
        used = [j for j in wanted_too if j < table.shape[1]]
        once = distinct_rows(table[:, used], table[:, i])
        table = table[once]
        t = table[:, i] + sum(
            table[:, at[name]] * CLOCK_PARTS[name]
            for name in CLOCK_PARTS.keys() & at.keys() - FRACTIONS.keys()
        )
        parted = any(name in at for name in FRACTIONS)
        self._refuse_constant(t, parted)
        if not parted:
            if (spread := self._spread(wanted, t)) is not None:
                return replace(spread, written_again=not once.all())
            if once.all() and not wanted.tick and (tick := coarse_tick(t)):
                wanted = self._between_steps(wanted, t, tick)
        return wanted if wanted.time_unit else self._told(wanted, table, i)

    def _refuse_constant(self, t: Array, parted: bool) -> None:
        """Refuse times (n,) that do not say when a row was taken.

        `parted` is whether another column holds fractions of them.

        Raises
        ------
        InputError
            With what to say instead.

        """
        if (value := constant_value(t)) is not None:
            raise InputError(
                f"{self._of.path}: column t is {value:.10g} in all rows, so it is no"
                " time: name it _ in --columns, and give --rate"
            )
        if (share := share_of_one_time(t)) and not parted:
            raise InputError(
                f"{self._of.path}: {100 * share:.0f} % of its rows have the time of the"
                " row before, as where it was written with too few digits, so it does"
                " not say when they were taken: name it _ in --columns, and give --rate"
            )

    def _between_steps(self, wanted: ReadOptions, t: Array, tick: float) -> ReadOptions:
        """Options by which rows lie between the steps of a coarse clock, and say so."""
        share = 100 * float((np.diff(t) == 0).mean())
        steps = f"{tick:.6g} {wanted.time_unit}".strip()
        self._of.says.append(
            f"its clock steps by {steps}, and {share:.0f} % of its rows have"
            " the time of the row before: they are put between its steps"
        )
        return replace(wanted, tick=tick)

    def _counts_down(self, wanted: ReadOptions, table: Array, i: int) -> bool:
        """Whether times fall and rows stand in their order: say so.

        As gravity turns from row to row, the rates tell in which order they were taken;
        of rows that were written newest first, both would turn against each other.
        """
        if not (falls_each_row(table[:, i]) and turns_in_order(wanted, table)):
            return False
        self._of.says.append(
            "its times fall from row to row, and gravity turns as the rates say if the"
            " rows were taken in this order: its timer counts down"
        )
        return True

    def _spread(self, wanted: ReadOptions, t: Array) -> ReadOptions | None:
        """Options by which rows of one time (n,) are spread; None if none do.

        Raises
        ------
        InputError
            If the number of rows that share a time varies.

        """
        if (shared := shared_times(t)) is None:
            return None
        spread = batch_options(wanted, shared, t)
        if spread is None and shared.equal:
            asks = ask_rate_of_shared_times(wanted, shared, t)
            raise InputError(f"{self._of.path}: {asks}")
        return None if spread is None else self._said(spread)

    def _told(self, wanted: ReadOptions, table: Array, i: int) -> ReadOptions:
        """Options with the unit of times that their numbers, a rate or a name tell.

        Parameters
        ----------
        wanted, table : options, and (n, k) the first rows
        i : column of the times

        """
        t = table[:, i]
        if is_clock_number(t):
            self._of.guessed["time"] = (
                f"{CLOCK_NUMBER}: no second of a minute is beyond 60"
            )
            return replace(wanted, time_unit=CLOCK_NUMBER)
        if counts_from_long_ago(t):
            self._of.guessed["time"] = f"{TICKED}, as Windows and .NET count them"
            return replace(wanted, time_unit=TICKED)
        said = self._of.rate_said()
        if self._own and said is None and is_row_counter(t):
            raise InputError(f"{self._of.path}: {ask_rate_of_counter(wanted, table)}")
        if wanted.rate_hz:
            return self._beside_rate(wanted, wanted.rate_hz, t)
        names = [c.name for way in self._of.heading() for c in way.columns[i : i + 1]]
        unit, why = "", "its name says ticks"
        if said is not None:
            unit, why = time_unit_of_rate(t, said[0]), f"it says the rate: {said[1]!r}"
        elif any(TICK in name.lower() for name in names):
            unit = time_unit_of_ticks(t)
        elif any(BOSCH[0] in name.lower() for name in names):
            unit, why = BOSCH[1], "its name is that of Bosch's counter"
        if unit in ("", "s"):
            return wanted
        self._of.guessed["time"] = f"{unit}: {why}"
        return replace(wanted, time_unit=unit)

    def _beside_rate(self, wanted: ReadOptions, rate: float, t: Array) -> ReadOptions:
        """Options with the unit of times (n,) that a rate beside them tells."""
        unit, makes = time_unit_near_rate(t, rate)
        if not unit:
            tick = tick_at_rate(t, rate)
            count = f" add --time-unit {tick} if they count about so much, or"
            raise InputError(
                f"{self._of.path}: its times make {rate:g} Hz in no usual unit: leave"
                f" --rate out, or{count if tick else ''} name the columns with _ for"
                " that of the times"
            )
        if unit != "s":
            self._of.guessed["time"] = f"{unit}: you say {rate:g} Hz"
        if abs(np.log(makes / rate)) > RATE_TOLERANCE:
            self._of.says.append(
                f"its times make {makes:.4g} Hz, not {rate:g} Hz as you say: they are"
                " taken"
            )
        return replace(wanted, time_unit=unit, rate_hz=None)

    def _said(self, spread: ReadOptions) -> ReadOptions:
        """Options by which rows of one batch do not all have its time, and say so."""
        if batch := spread.batch:
            self._of.guessed["time"] = (
                f"{spread.time_unit}, of {batch.rows:.0f} rows that come together each"
                f" {batch.seconds:.3g} s: they are spread evenly,"
                f" {batch.rows / batch.seconds:.4g} Hz"
            )
        return spread
