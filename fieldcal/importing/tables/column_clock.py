"""Which columns of a file hold its clock, or the rate that it says instead.

A clock may lie in two columns, or be what the user takes for steps of time. Where there
is none, the rate is asked for.
"""

from __future__ import annotations

from dataclasses import replace

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.importing import columns
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.tables.column_source import (
    ColumnSource,
    column_numbers,
    holds_means,
)
from fieldcal.importing.tables.column_times import (
    ask_rate_of_counter,
    constant_value,
    grows_each_row,
    is_row_counter,
    rate_hint,
    split_seconds,
)
from fieldcal.importing.tables.time_column import TimeColumn
from fieldcal.importing.words.heading_words import heading_meaning


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
            return TimeColumn(self._of, self._own).settled(wanted)
        if wanted.rate_hz:
            return wanted
        said = self._of.rate_said()
        if said is None:
            # of means nobody knows when: they are counted
            means = holds_means(self._of, wanted)
            return replace(wanted, rate_hz=1.0) if means else wanted
        rate, where = said
        sentence = f"it says the rate: {where!r}"
        self._of.says += [sentence] if sentence not in self._of.says else []
        return replace(wanted, rate_hz=rate)

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
