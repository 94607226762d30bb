"""Which columns of a file are whose: the user, names or physics say it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from shlex import quote
from typing import Protocol

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import ACC, CHANNELS, Array
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
from fieldcal.importing.tables import column_physics
from fieldcal.importing.tables.axis_triples import unnamed_axes
from fieldcal.importing.tables.column_choices import ask_of_choices, columns_option
from fieldcal.importing.tables.column_source import (
    ColumnSource,
    column_numbers,
    holds_means,
)
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
from fieldcal.importing.tables.own_times import OwnTimes, own_times
from fieldcal.importing.words.heading_words import heading_meaning


class AskingSource(ColumnSource, Protocol):
    """A file of columns that asks where nothing tells what they are.

    Attributes
    ----------
    wanted : options of the user
    told_by : what says the sensor of its columns

    """

    wanted: ReadOptions
    told_by: str

    def ask(self) -> str:
        """What to do where nothing tells its columns."""


class ColumnFinder:
    """Finds the columns of each IMU in a file.

    Parameters
    ----------
    source : the file, to whose remarks what was found is added

    Attributes
    ----------
    own_times : times of each sensor, where they are not the same; known after `imus`

    """

    def __init__(self, source: AskingSource) -> None:
        self._of = source
        self.own_times: OwnTimes | None = None

    def imus(self) -> dict[str, ReadOptions]:
        """Options of each IMU by its name.

        Raises
        ------
        InputError
            If nothing tells what the columns are, with what to say.

        """
        if self._of.wanted.columns:
            return {"0": self._with_units_of_names()}
        table, headed = self._of.beginning(), self._of.heading()
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
        return self._taken(named or self._weakly_named(checked, headed, table), way)

    def _weakly_named(
        self, checked: Sequence[Heading], headed: Sequence[Heading], table: Array
    ) -> tuple[HeadingMatch, ...]:
        """What headings may mean where no name is clear.

        The question of their size then comes before that of their columns.
        """
        for said in checked:
            if named := headings.match_headings(*said, weak=True):
                return named
        question = ask_of_choices(table, next(iter(headed), None))
        raise InputError(f"{self._of.path}: {question}" if question else self._of.ask())

    def _taken(
        self, named: tuple[HeadingMatch, ...], way: Heading | None
    ) -> dict[str, ReadOptions]:
        """Options of IMUs that names tell, without those that copy another."""
        table = self._of.beginning()
        taken = {one.name: one.taken(self._of.wanted) for one in named}
        places = {name: column_numbers(self._of, one) for name, one in taken.items()}
        copies = copied_imus(table, places)
        self._of.says += tell_copied(copies)
        named = tuple(one for one in named if one.name not in copies)
        if copies and len(named) == 1:
            taken = {"0": taken[named[0].name]}
            named = (replace(named[0], name="0"),)
        taken = {one.name: taken[one.name] for one in named}
        if len(named) == 1 and way is not None and way.skip:
            at = column_numbers(self._of, taken[named[0].name])
            self.own_times = own_times(way.columns, at, table)
        self._tell_taken(named, taken)
        return taken

    def _tell_taken(
        self, named: Sequence[HeadingMatch], taken: Mapping[str, ReadOptions]
    ) -> None:
        """Say what was taken from names."""
        rate = self._of.rate_said()
        for one in named:
            timed = rate is not None or holds_means(self._of, taken[one.name])
            sentence = one.sentence(taken[one.name], timed, self._of.told_by)
            alone = [sentence] if len(named) == 1 else []
            says = self._of.says
            says += [s for s in (*alone, *one.says) if s not in says]

    def _with_units_of_names(self) -> ReadOptions:
        """What the user says, with the units that stand over the columns so named."""
        wanted, at = self._of.wanted, column_numbers(self._of, self._of.wanted)
        table = self._of.beginning()
        for way in self._of.heading():
            if len(way.columns) == table.shape[1]:
                apart = own_times(way.columns, at, table)
                if apart is not None and apart.force == at["t"]:
                    self.own_times = apart
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
            self._of.says += [said] if said not in self._of.says else []
        return with_them

    def _told(
        self, named: Sequence[HeadingMatch], way: Heading | None
    ) -> ReadOptions | None:
        """Options by physics, where names do not say all."""
        table = self._of.beginning()
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
        wanted = named[0].taken(self._of.wanted) if named else self._of.wanted
        said = ",".join(with_signs(chosen, wanted.reversed))
        self._of.guessed["columns"] = f"{said}: {told.why}"
        self._of.says += [
            s for one in named[:1] for s in one.says if s not in self._of.says
        ]
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
        threes = unnamed_axes(self._of.beginning(), names, {*known, *others})
        if not threes:
            return
        which, *more = (" ".join(names[i] or f"column {i + 1}" for i in three)
                        for three in threes)  # fmt: skip
        if "ax" in known.values():
            all_of_them = ", ".join([which, *more])
            self._of.says.append(
                f"{all_of_them}: nothing says what they are; they are left out"
            )
            return
        axes = zip(threes[0], ("ax", "ay", "az"), strict=True)
        places = [c.place for c in way.columns]
        with_them = columns_option(known | dict(axes), places, way.skip)
        raise InputError(
            f"{self._of.path}: the names of its columns say where the gyroscopes are,"
            f" and nothing tells whether {which} are the accelerometers: add --columns"
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


def _without(table: Array, numbers: Sequence[int]) -> Array:
    """A table (n, k) with nan in some columns."""
    out = table.copy()
    if len(out):
        out[:, list(numbers)] = np.nan
    return out
