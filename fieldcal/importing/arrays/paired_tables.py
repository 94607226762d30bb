"""Arrays of sensors that each have times of their own, put side by side.

A telephone's log in MATLAB or HDF5 has an array for each sensor, as long as that sensor
was sampled often. What lies beside the accelerometer is made as long as its arrays: of
each of its samples the nearest of the other sensor, within half a period; nothing is
interpolated. Of a thermometer, which is slow, the nearest however far.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Index
from fieldcal.importing.arrays.array_tables import ArrayTable, columns_of
from fieldcal.importing.times.alignment import nearest_in_time
from fieldcal.importing.times.clock_ratio import clock_ratio, say_apart, say_ratio
from fieldcal.importing.words.heading_words import HeadingMeaning, heading_meaning

KINDS = {"a": "accelerometer", "g": "gyroscope", "temperature": "thermometer"}
"""What is put beside each other, the one whose samples are kept first."""

NOTHING = -1
"""In place of a row where none is near."""


class ClockedArrays(NamedTuple):
    """Arrays of one sensor, with the times of its rows.

    Attributes
    ----------
    names : of its arrays
    clock : array that holds its times, which may be one of them
    at : which column of that does
    t : (n,) its times, in whatever unit

    """

    names: tuple[str, ...]
    clock: str
    at: int
    t: Array


class ArrayPairing(NamedTuple):
    """Pairing of the arrays of a file by time.

    Attributes
    ----------
    rows : array and rows (n,) of it that lie beside those of the accelerometer,
        `NOTHING` where none does
    inside : arrays of these whose column of times is left out, and which it is
    dropped : arrays that are left out: other clocks, and what has none
    says : what was done, a sentence each

    """

    rows: Mapping[str, Index]
    inside: Mapping[str, int]
    dropped: tuple[str, ...]
    says: tuple[str, ...]

    def of(self, tables: Mapping[str, ArrayTable]) -> dict[str, ArrayTable]:
        """The arrays side by side."""
        return {
            name: self._beside(name, table) if name in self.rows else table
            for name, table in tables.items()
            if name not in self.dropped
        }

    def _beside(self, name: str, table: ArrayTable) -> ArrayTable:
        rows, inside = self.rows[name], self.inside.get(name, table.shape[1])
        kept = [i for i in range(table.shape[1]) if i != inside]

        def read(some: slice, columns: Sequence[int]) -> list[Array]:
            at = rows[some]
            there = at[at != NOTHING]
            if not len(there):
                return [np.full(len(at), np.nan) for _ in columns]
            first, last = int(there.min()), int(there.max())
            part = table.read(slice(first, last + 1), [kept[i] for i in columns])
            near = np.where(at == NOTHING, 0, at - first)
            return [np.where(at == NOTHING, np.nan, one[near]) for one in part]

        return ArrayTable((len(rows), len(kept)), read, table.unit)


def pair_arrays(tables: Mapping[str, ArrayTable]) -> ArrayPairing | None:
    """Pair the arrays of sensors that have separate times.

    None where they have the same, or where no names and no times tell.

    Raises
    ------
    InputError
        If the accelerometer and the gyroscope have no times in common.

    """
    named = _by_kind(tables)
    own = {kind: _with_clock(kind, tables, named) for kind in KINDS}
    acc, others = own["a"], {k: one for k, one in own.items() if one and k != "a"}
    if acc is None or "g" not in others or not _have_own_times(acc, others["g"]):
        return None
    rows, inside, says = dict[str, Index](), dict[str, int](), list[str]()
    for kind, one in others.items():
        if not _have_own_times(acc, one):
            continue
        ratio = clock_ratio(acc.t, one.t)
        if ratio is None and kind == "g":
            raise InputError(
                say_apart(acc.t, one.t, "its accelerometer", "its gyroscope")
            )
        t = one.t * (ratio or 1.0)
        says += say_ratio(ratio or 1.0, f"its {KINDS[kind]}")
        found, apart = nearest_in_time(acc.t, t)
        if kind == "g":
            near = apart <= np.median(np.diff(acc.t)) / 2
            found = np.where(near, found, NOTHING)
        rows |= dict.fromkeys(one.names, found)
        inside |= {one.clock: one.at} if one.clock in one.names else {}
        says.append(
            f"its {KINDS[kind]} has times of its own: each sample of the accelerometer"
            " goes with the nearest"
        )
    clocks = {one.clock for one in others.values()} - {acc.clock}
    dropped = tuple(
        name for name, table in tables.items()
        if name not in rows and (name in clocks or table.shape[0] != len(acc.t))
    )  # fmt: skip
    return ArrayPairing(rows, inside, dropped, tuple(says))


def _have_own_times(one: ClockedArrays, other: ClockedArrays) -> bool:
    """Whether two sensors were sampled at different times."""
    return one.clock != other.clock and not np.array_equal(one.t, other.t)


def _by_kind(tables: Mapping[str, ArrayTable]) -> dict[str, list[str]]:
    """Names of the arrays of each sensor."""
    found: dict[str, list[str]] = {kind: [] for kind in KINDS}
    for name, table in tables.items():
        said = {one.kind for one in _column_meanings(name, table) if one is not None}
        for kind in KINDS.keys() & said:
            found[kind].append(name)
    return found


def _column_meanings(name: str, table: ArrayTable) -> list[HeadingMeaning | None]:
    """Meaning of each column of an array, by its name."""
    return [heading_meaning(c.name, c.unit) for c in columns_of({name: table})]


def _with_clock(
    kind: str, tables: Mapping[str, ArrayTable], named: Mapping[str, list[str]]
) -> ClockedArrays | None:
    """A sensor with its clock; None if the clock cannot be identified."""
    names = named[kind]
    lengths = {tables[name].shape[0] for name in names}
    if len(lengths) != 1:
        return None
    (length,) = lengths
    clocks = [
        (name, at)
        for name, table in tables.items()
        if table.shape[0] == length
        for at, said in enumerate(_column_meanings(name, table))
        if said is not None and said.kind == "t" and _of_the_same(name, names)
    ]
    own = [one for one in clocks if one[0] in names] or clocks
    if len(own) != 1:
        return None
    ((clock, at),) = own
    (t,) = tables[clock].read(slice(0, length), [at])
    if not np.isfinite(t).all() or (np.diff(t) < 0).any():
        return None
    return ClockedArrays(tuple(names), clock, at, t)


def _of_the_same(clock: str, names: Sequence[str]) -> bool:
    """Whether a clock may belong to a sensor, by its name."""
    said = [
        heading_meaning(f"{clock}_x"),
        *(heading_meaning(f"{name}_x") for name in names),
    ]
    kinds = [one.kind for one in said if one is not None and one.kind in KINDS]
    return len(set(kinds)) < len("ag")
