"""A recording in columns: the user, names or physics say what each of them is."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import replace
from shlex import quote
from typing import Any

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import ACC, CHANNELS, Array, Block
from fieldcal.importing import columns
from fieldcal.importing.headings import headings
from fieldcal.importing.headings.column_units import (
    unit_options,
    units_over,
    with_units,
)
from fieldcal.importing.headings.heading import (
    NAMES,
    Heading,
    HeadingMatch,
    with_signs,
)
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.recording import ImuStream, MeanScatter, Recording
from fieldcal.importing.tables import column_physics
from fieldcal.importing.tables.axis_triples import unnamed_axes
from fieldcal.importing.tables.column_choices import ask_of_choices, columns_option
from fieldcal.importing.tables.column_clock import ColumnClock, ask_rate
from fieldcal.importing.tables.column_source import column_numbers, holds_means
from fieldcal.importing.tables.column_times import is_row_counter
from fieldcal.importing.tables.copied_imus import copied_imus, tell_copied
from fieldcal.importing.tables.heading_forces import with_checked_forces
from fieldcal.importing.tables.heading_times import with_checked_times
from fieldcal.importing.tables.known_channels import (
    is_complete,
    known_columns,
    match_quality,
    named_channels,
)
from fieldcal.importing.tables.means import row_scatter
from fieldcal.importing.tables.own_times import OwnTimes, SensorsApart, own_times
from fieldcal.importing.tables.scatter_columns import scatter_columns
from fieldcal.importing.tables.table_speeds import speed_column, speed_unit
from fieldcal.importing.text.rows_in_turn import RowsInTurn
from fieldcal.importing.times.row_validator import RowValidator
from fieldcal.importing.words.heading_words import heading_meaning


class ColumnRecording(Recording):
    """A file of columns, with one IMU in it or several side by side."""

    asks_units = True
    imus_found: dict[str, ReadOptions] | None = None
    """Options of each IMU by its name, once they were looked for."""

    in_turn = False
    """Whether its rows hold the accelerometer or the gyroscope, as far as is known."""

    _own_times: OwnTimes | None = None
    """Times of each sensor, where they are not the same."""

    told_by = NAMES
    """What says the sensor of its columns."""

    @abstractmethod
    def heading(self) -> list[Heading]:
        """What may be read as names of its columns, the likeliest first."""

    @abstractmethod
    def beginning(self) -> Array:
        """Numbers of the first rows, (n, k); nan where a cell is none. May be empty."""

    @abstractmethod
    def ask(self) -> str:
        """What to do where nothing tells its columns."""

    @abstractmethod
    def read_samples(self) -> Iterator[Block]:
        """Samples of the one IMU in it, row by row as they stand."""

    def rate_said(self) -> tuple[float, str] | None:
        """Sampling rate, Hz, that the file says of itself, and where; or None."""
        return None

    def streams(self) -> list[ImuStream]:
        """Return the IMUs in it."""
        found = self.imus()
        for wanted in found.values():
            ask_rate(self, wanted)
            columns.check_columns(wanted)
        return [
            ImuStream(name, f"columns in {columns.describe_units(wanted)}")
            for name, wanted in found.items()
        ]

    def notes(self, stream: str) -> dict[str, Any]:
        """Return the units."""
        return columns.unit_notes(self.wanted)

    def alone(self, stream: str) -> Recording:
        """The recording with the columns of one IMU."""
        wanted = self.imus()[stream]
        one = super().alone(stream)
        one.wanted = wanted
        if isinstance(one, ColumnRecording):
            one.imus_found = {stream: wanted}
        return one

    def imus(self) -> dict[str, ReadOptions]:
        """Options of each IMU by its name."""
        if self.imus_found is None:
            own = not self.wanted.columns
            found = self._found()
            self.imus_found = {
                name: ColumnClock(self, one, own).settled for name, one in found.items()
            }
            if len(self.imus_found) == 1:
                (self.wanted,) = self.imus_found.values()
        if len(self.imus_found) == 1:
            # units may have been found meanwhile
            return dict.fromkeys(self.imus_found, self.wanted)
        return self.imus_found

    def blocks(self, stream: str) -> Iterator[Block]:
        """Samples of an IMU, also where each row holds one of two sensors alone."""
        if len(self.imus()) > 1:
            yield from self.alone(stream).blocks(stream)
            return
        if self._own_times is not None:
            yield from self._sensors_apart(self._own_times)
            return
        rows = RowsInTurn(str(self.path), self.repair)
        for block in rows.through(self.read_samples()):
            self.in_turn = rows.told
            yield block
        self.says += [s for s in rows.says if s not in self.says]
        self.mended += [s for s in rows.mended if s not in self.mended]

    def _sensors_apart(self, times: OwnTimes) -> Iterator[Block]:
        """Samples of sensors that have times of their own, each with the nearest."""
        both = []
        for wanted in times.options(self.wanted):
            one = copy(self)
            one.says, one.mended, one.wanted, one.from_first = [], [], wanted, False
            both.append(one)
        judges = [RowValidator(str(one.path), one.place, one.repair) for one in both]
        apart = SensorsApart(str(self.path), judges)
        for block in apart.through(*(one.read_samples() for one in both)):
            self.began = apart.began
            since = apart.began if self.from_first and len(block) else 0.0
            yield replace(block, t=block.t - since)
        for one, judge in zip(both, judges, strict=True):
            says, mended = [*one.says, *judge.says], [*one.mended, *judge.mended]
            self.says += [s for s in says if s not in self.says]
            self.mended += [s for s in mended if s not in self.mended]
        self.says.append(apart.sentence)

    def scatter(self) -> MeanScatter | None:
        """What its columns say of the scatter, if its rows are means."""
        table, wanted = self.beginning(), self.wanted
        if not holds_means(self, wanted):
            return None
        at = column_numbers(self, wanted)
        fits = (w for w in self.heading() if len(w.columns) == table.shape[1])
        named = next(fits, Heading([])).columns
        where = scatter_columns(named)
        means, values = (_columns_of(table, places) for places in (at, where))
        count = table[:, where["n"]] if "n" in where else None
        timed, speed = columns.has_time(wanted.columns), speed_column(named)
        if speed is None or speed in {i for c, i in at.items() if c != columns.SKIP}:
            return MeanScatter(means, values, count, timed)
        unit = speed_unit(named[speed])
        return MeanScatter(means, values, count, timed, table[:, speed], unit)

    def row_sigma(self, gravity: float) -> float | None:
        """Standard deviation of its rows, m/s^2, if each may be a position."""
        table, at = self.beginning(), column_numbers(self, self.wanted)
        if not {"ax", "ay", "az"} <= set(at) or not len(table):
            return None
        acc = table[:, [at["ax"], at["ay"], at["az"]]] * self.wanted.acc_scale
        return row_scatter(acc[np.isfinite(acc).all(axis=1)], gravity)

    def _found(self) -> dict[str, ReadOptions]:
        if self.wanted.columns:
            return {"0": self._with_units_of_names()}
        table = self.beginning()
        headed = self.heading()
        checked = [
            with_checked_forces(with_checked_times(way, table), table) for way in headed
        ]
        ways = [
            (headings.match_headings(*said), way)
            for said, way in zip(checked, headed, strict=True)
        ]
        named = max((found for found, _ in ways), key=match_quality, default=())
        way = next((w for found, w in ways if found and found is named), None)
        thermometer = bool(named) and not named_channels(named[0]) & {"ax", "gx"}
        if len(named) < 2 and not (thermometer or is_complete(named)):
            beside = () if named else _beside(checked, table)
            told = self._told(named or beside, way or next((w for _, w in ways), None))
            if told is not None:
                return {"0": told}
        if not (thermometer or all(is_complete([one]) for one in named)):
            self._say_unnamed(named, way)
        for said in checked if not named else ():
            # the question of their size comes before that of their columns
            named = named or headings.match_headings(*said, weak=True)
        if not named:
            first = next(iter(headed), None)
            question = ask_of_choices(table, first)
            raise InputError(f"{self.path}: {question}" if question else self.ask())
        taken = {one.name: one.taken(self.wanted) for one in named}
        places = {name: column_numbers(self, one) for name, one in taken.items()}
        copies = copied_imus(table, places)
        self.says += tell_copied(copies)
        named = tuple(one for one in named if one.name not in copies)
        if copies and len(named) == 1:
            taken = {"0": taken[named[0].name]}
            named = (replace(named[0], name="0"),)
        taken = {one.name: taken[one.name] for one in named}
        if len(named) == 1 and way is not None and way.skip:
            at = column_numbers(self, taken[named[0].name])
            self._own_times = own_times(way.columns, at, table)
        rate = self.rate_said()
        for one in named:
            timed = rate is not None or holds_means(self, taken[one.name])
            sentence = one.sentence(taken[one.name], timed, self.told_by)
            alone = [sentence] if len(named) == 1 else []
            self.says += [s for s in (*alone, *one.says) if s not in self.says]
        return taken

    def _with_units_of_names(self) -> ReadOptions:
        """What the user says, with the units that stand over the columns so named."""
        wanted, at = self.wanted, column_numbers(self, self.wanted)
        table = self.beginning()
        for way in self.heading():
            if len(way.columns) == table.shape[1]:
                apart = own_times(way.columns, at, table)
                if apart is not None and apart.force == at["t"]:
                    self._own_times = apart
                with_them = self._with_units_over(wanted, way, at)
                if with_them != wanted:
                    return with_them
        return wanted

    def _with_units_over(
        self, wanted: ReadOptions, way: Heading, at: Mapping[str, int]
    ) -> ReadOptions:
        """Options with the units that stand over channels in numbered columns."""
        with_them = with_units(wanted, units_over(way.columns, at))
        if with_them != wanted:
            options = " ".join(unit_options(wanted, with_them))
            said = f"taken from {NAMES}: {options}"
            self.says += [said] if said not in self.says else []
        return with_them

    def _told(
        self, named: Sequence[HeadingMatch], way: Heading | None
    ) -> ReadOptions | None:
        """Options by physics, where names do not say all."""
        table = self.beginning()
        k = table.shape[1]
        names = [c.name for c in way.columns] if way else []
        names = names if len(names) == k else [""] * k
        known = known_columns(named, way)
        over = way.columns if way is not None and len(way.columns) == k else []
        told = column_physics.identify_columns(
            _without(table, headings.columns_without_axes(over)), names, known
        )
        if "gx" not in (known if told is None else told.channels).values():
            # names of rates that may be angles, which do not turn gravity
            doubted = _without(table, headings.columns_without_axes(over, True))
            told = column_physics.turning_columns(doubted, names, known) or told
        if told is None:
            return None
        places = [c.place for c in way.columns] if way and not way.skip else [""] * k
        pairs = [(told.channels.get(i, columns.SKIP), places[i]) for i in range(k)]
        chosen = tuple(
            f"{name}={place}" if place else name
            for name, place in pairs
            if name != columns.SKIP or not place
        )
        wanted = named[0].taken(self.wanted) if named else self.wanted
        said = ",".join(with_signs(chosen, wanted.reversed))
        self.guessed["columns"] = f"{said}: {told.why}"
        self.says += [s for one in named[:1] for s in one.says if s not in self.says]
        wanted = replace(wanted, columns=chosen)
        if way is None or len(way.columns) != k:
            return wanted
        at = {channel: i for i, channel in told.channels.items()}
        # names that do not say all may say that gravity is lacking
        free = headings.are_free([way.columns[at[c]] for c in CHANNELS[ACC] if c in at])
        wanted = replace(wanted, free=free, no_gain=wanted.no_gain or free)
        return self._with_units_over(wanted, way, at)

    def _say_unnamed(self, named: Sequence[HeadingMatch], way: Heading | None) -> None:
        """Ask about axes that no name says where none are the accelerometers.

        Raises
        ------
        InputError
            With the columns both ways.

        """
        if not named or way is None:
            return
        known: dict[int, str] = {}
        for one in named:
            known |= known_columns([one], way)
        others = {
            i for i, c in enumerate(way.columns) if heading_meaning(c.name, c.unit)
        } | {*headings.columns_without_axes(way.columns)}
        names = [c.name for c in way.columns]
        threes = unnamed_axes(self.beginning(), names, {*known, *others})
        if not threes:
            return
        which, *more = (" ".join(names[i] or f"column {i + 1}" for i in three)
                        for three in threes)  # fmt: skip
        if "ax" in known.values():
            all_of_them = ", ".join([which, *more])
            self.says.append(
                f"{all_of_them}: nothing says what they are; they are left out"
            )
            return
        axes = zip(threes[0], ("ax", "ay", "az"), strict=True)
        places = [c.place for c in way.columns]
        with_them = columns_option(known | dict(axes), places, way.skip)
        raise InputError(
            f"{self.path}: the names of its columns say where the gyroscopes are, and"
            f" nothing tells whether {which} are the accelerometers: add --columns"
            f" {quote(with_them)} if they are, or --columns"
            f" {quote(columns_option(known, places, way.skip))}"
        )


def _beside(ways: Sequence[Heading], table: Array) -> tuple[HeadingMatch, ...]:
    """Time and thermometer by the first heading of a table (n, k) that names no axis.

    What only counts the rows is left to the question for the rate.
    """
    for way in ways:
        if len(way.columns) == table.shape[1]:
            counts = [is_row_counter(column) for column in table.T]
            names = [
                column._replace(name="") if counted else column
                for column, counted in zip(way.columns, counts, strict=True)
            ]
            if (found := headings.match_beside(names, way.skip)) is not None:
                return (found,)
    return ()


def _columns_of(table: Array, places: Mapping[str, int]) -> Array:
    """Numbers (n, 6) of the channels that stand in a table; nan of others."""
    found = np.full((len(table), len(CHANNELS)), np.nan)
    for i, channel in enumerate(CHANNELS):
        if channel in places:
            found[:, i] = table[:, places[channel]]
    return found


def _without(table: Array, numbers: Sequence[int]) -> Array:
    """A table (n, k) with nan in some columns."""
    out = table.copy()
    if len(out):
        out[:, list(numbers)] = np.nan
    return out
