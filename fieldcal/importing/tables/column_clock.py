"""What the times and counts of a file in columns are, by its first rows and its words.

A clock may lie in two columns, hold hours and minutes in one number, or count ticks or
rows; the file may say its rate. What only the user can know is asked.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Protocol

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.importing import columns
from fieldcal.importing.headings.heading import Heading
from fieldcal.importing.recording import CLOCK_NUMBER, ReadOptions
from fieldcal.importing.tables.column_times import (
    ask_rate_of_counter,
    ask_rate_of_shared_times,
    batch_options,
    constant_value,
    falls_each_row,
    grows_each_row,
    is_clock_number,
    is_row_counter,
    rate_hint,
    share_of_one_time,
    split_seconds,
    turns_in_order,
)
from fieldcal.importing.times.repeats import NO_VALUES, distinct_rows
from fieldcal.importing.times.row_times import CLOCK_PARTS, FRACTIONS
from fieldcal.importing.units.gravity_size import are_means
from fieldcal.importing.units.time_units import (
    RATE_TOLERANCE,
    TICKED,
    coarse_tick,
    counts_from_long_ago,
    shared_times,
    time_unit_near_rate,
    time_unit_of_rate,
    time_unit_of_ticks,
)
from fieldcal.importing.words.heading_words import heading_meaning

TICK = "fine"
"""Part of the name of times that count ticks: ``SampleTimeFine``."""


BOSCH = ("sensortime", "39.0625us")
"""Name of the counter of sensors by Bosch, and what it counts."""


class ColumnSource(Protocol):
    """Members of a file of columns that `ColumnClock` uses.

    Attributes
    ----------
    path, says, guessed : as of a recording

    """

    path: Path
    says: list[str]
    guessed: dict[str, str]

    def heading(self) -> list[Heading]:
        """What may be read as names of its columns."""

    def beginning(self) -> Array:
        """Numbers of the first rows, (n, k)."""

    def rate_said(self) -> tuple[float, str] | None:
        """Rate that the file says, and where."""


class ColumnClock:
    """Finds the times of one IMU.

    Parameters
    ----------
    source : the file
    wanted : options of one IMU
    own : whether the columns are those that the file says

    """

    def __init__(self, source: ColumnSource, wanted: ReadOptions, own: bool) -> None:
        self._of, self._wanted, self._own = source, wanted, own

    @property
    def settled(self) -> ReadOptions:
        """Options with the columns and the unit of its times, or its rate.

        Raises
        ------
        InputError
            If its times do not say when a row was taken.

        """
        wanted = self._wanted
        wanted = self._clocked(wanted) if self._own else self._without_sums(wanted)
        return self._signed(self._rated(wanted))

    def _clocked(self, wanted: ReadOptions) -> ReadOptions:
        """Options with both columns of a clock that has its seconds in one of them."""
        table, at = self._of.beginning(), column_numbers(self._of, wanted)
        own = [at[name] for name in ("t", "dt") if name in at]
        wholes = own or [i for i in range(table.shape[1]) if i not in at.values()]
        split = split_seconds(table, wholes)
        if split is None or wanted.rate_hz:
            return wanted
        named = [c for c in wanted.columns]
        places = [c.place for way in self._of.heading() for c in way.columns]
        for i, name in ((split.whole, "t"), (split.fraction, split.name)):
            if len(named) == table.shape[1] and not any("=" in c for c in named):
                named[i] = name
            elif f"{name}={places[i]}" not in named:
                named = [*(c for c in named if not c.endswith(f"={places[i]}")),
                         f"{name}={places[i]}"]  # fmt: skip
        self._of.says.append(
            "its clock has whole seconds and what is beyond them apart"
        )
        return replace(wanted, columns=tuple(named), time_unit="s")

    def _without_sums(self, wanted: ReadOptions) -> ReadOptions:
        """Options with the time where what the user calls its steps only grows.

        Raises
        ------
        InputError
            If it counts rows.

        """
        table, at = self._of.beginning(), column_numbers(self._of, wanted)
        i = at.get("dt", -1)
        if not 0 <= i < table.shape[1] or not grows_each_row(table[:, i]):
            return wanted
        named = tuple(
            f"t{c[len('dt') :]}" if c.partition("=")[0] == "dt" else c
            for c in wanted.columns
        )
        wanted = replace(wanted, columns=named)
        if is_row_counter(table[:, i]) and not wanted.time_unit:
            raise InputError(f"{self._of.path}: {ask_rate_of_counter(wanted, table)}")
        self._of.says.append(
            "column dt grows from row to row: it is taken for t, the time, and not for"
            " the time since the row before"
        )
        return wanted

    def _rated(self, wanted: ReadOptions) -> ReadOptions:
        """Options with the rate that the file says, or with the unit of its times."""
        if columns.has_time(wanted.columns):
            return self._ticked(wanted)
        if wanted.rate_hz:
            return wanted
        said = self._of.rate_said()
        if said is None:
            at = column_numbers(self._of, wanted)
            three = [at[c] for c in ("ax", "ay", "az") if c in at]
            table = (
                self._of.beginning() if len(three) == len("xyz") else np.empty((0, 0))
            )
            means = len(table) and are_means(table[:, three])
            # of means nobody knows when: they are counted
            return replace(wanted, rate_hz=1.0) if means else wanted
        rate, where = said
        sentence = f"it says the rate: {where!r}"
        self._of.says += [sentence] if sentence not in self._of.says else []
        return replace(wanted, rate_hz=rate)

    def _ticked(self, wanted: ReadOptions) -> ReadOptions:
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
        if (value := constant_value(t)) is not None:
            raise InputError(
                f"{self._of.path}: column t is {value:.10g} in all rows, so it is no"
                " time: name it _ in --columns, and give --rate"
            )
        if (share := share_of_one_time(t)) and not any(n in at for n in FRACTIONS):
            raise InputError(
                f"{self._of.path}: {100 * share:.0f} % of its rows have the time of the"
                " row before, as where it was written with too few digits, so it does"
                " not say when they were taken: name it _ in --columns, and give --rate"
            )
        if not any(name in at for name in FRACTIONS):
            if (spread := self._spread(wanted, t)) is not None:
                return replace(spread, written_again=not once.all())
            if once.all() and not wanted.tick and (tick := coarse_tick(t)):
                share = 100 * float((np.diff(t) == 0).mean())
                steps = f"{tick:.6g} {wanted.time_unit}".strip()
                self._of.says.append(
                    f"its clock steps by {steps}, and {share:.0f} % of its rows have"
                    " the time of the row before: they are put between its steps"
                )
                wanted = replace(wanted, tick=tick)
        return wanted if wanted.time_unit else self._told(wanted, table, i)

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
            raise InputError(
                f"{self._of.path}: its times make {rate:g} Hz in no unit: leave --rate"
                " out, or name the columns with _ for that of the times"
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

    def _signed(self, wanted: ReadOptions) -> ReadOptions:
        """Options with the kinds of channel whose sign was not read."""
        table, at = self._of.beginning(), column_numbers(self._of, wanted)
        threes = {k: [at[k + x] for x in "xyz" if k + x in at] for k in "ag"}
        found = {kind for kind, three in threes.items()
                 if three and max(three) < table.shape[1]
                 and columns.are_unsigned(table[:, three])}  # fmt: skip
        if found:
            self._of.guessed["counts"] = "of 16 bits with a sign: 65535 is -1"
        return replace(wanted, unsigned=frozenset(found))


def column_numbers(source: ColumnSource, wanted: ReadOptions) -> dict[str, int]:
    """Number of each channel's column among those of `beginning`."""
    names = [c.partition("=") for c in wanted.columns]
    if not any(place for _, _, place in names):
        return {name: i for i, (name, _, _) in enumerate(names)}
    places = [c.place for way in source.heading() for c in way.columns]
    return {n: places.index(p) for n, _, p in names if p in places}


def _no_time(name: str, t: Array) -> str:
    """Why numbers (n,) that are called a time are none, as far as it is known."""
    if is_row_counter(t):
        return f"its {name} only counts rows"
    value = constant_value(t)
    return "" if value is None else f"its {name} is {value:.10g} in all rows, no time"


def ask_rate(source: ColumnSource, wanted: ReadOptions) -> None:
    """Ask for the rate where no column is the time.

    Raises
    ------
    InputError
        With what the turns say of it.

    """
    if columns.has_time(wanted.columns) or wanted.rate_hz or not wanted.columns:
        return
    table = source.beginning()
    names = [c.name for way in source.heading() for c in way.columns][: table.shape[1]]
    said = {name: i for i, name in enumerate(names)
            if (one := heading_meaning(name)) is not None
            and one.kind == "t"}  # fmt: skip
    why = next(filter(None, (_no_time(n, table[:, i]) for n, i in said.items())), "")
    why = why or "no column is t, the time"
    hint = rate_hint(wanted, table)
    raise InputError(f"{source.path}: {why}: give the rate, e.g. --rate {hint}")
