"""Whether the accelerations of a table lack gravity that has columns of its own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.importing.headings.heading import Column, Heading
from fieldcal.importing.tables.column_physics import is_direction
from fieldcal.importing.times.gravity_sum import lacks_gravity
from fieldcal.importing.words.heading_words import heading_meaning
from fieldcal.importing.words.sensor_words import AXES

SMALL = 0.2
"""Part of the length of accelerations with gravity that others lack it below."""

SAME = 0.3
"""Part by which accelerations with gravity usually differ from it in length."""

USER = "user"
"""Word of an acceleration without gravity."""


def with_checked_forces(way: Heading, table: Array) -> Heading:
    """A heading in which accelerations that lack gravity are called so.

    Some programs call them as if they were whole, and write gravity beside them.

    Parameters
    ----------
    way : what stands above the columns
    table : (n, k) numbers of the first rows; nan where a cell is none

    """
    way = _without_small_forces(_with_gravity(way, table), table)
    acc, gravity = (_axes(way.columns, kind) for kind in "av")
    if not (acc and gravity) or table.shape[1] != len(way.columns):
        return way
    names = [*way.columns]
    if not lacks_gravity(table[:, acc], table[:, gravity]):
        if _are_as_long(table[:, acc], table[:, gravity]):
            # it is in them, and nothing is to be added
            for i in gravity:
                names[i] = names[i]._replace(name="")
        return Heading(names, way.skip)
    for i in acc:
        names[i] = names[i]._replace(name=f"{USER} {names[i].name}")
    return Heading(names, way.skip)


def _with_gravity(way: Heading, table: Array) -> Heading:
    """A heading in which gravity is called so, where ``gx gy gz`` are its parts.

    No gyroscope has the same length in all rows; what is calculated has.
    """
    rates = _axes(way.columns, "g")
    whole = bool(rates) and table.shape[1] == len(way.columns) and len(table) > 1
    if not whole or not is_direction(table[:, rates]):
        return way
    names = [*way.columns]
    for i, axis in zip(rates, AXES, strict=True):
        names[i] = names[i]._replace(name=f"gravity {axis}")
    return Heading(names, way.skip)


def _without_small_forces(way: Heading, table: Array) -> Heading:
    """A heading without accelerations that lack gravity, where others hold it.

    "Linear acceleration" may be either: their lengths tell which of two is which.
    """
    said = [heading_meaning(column.name, column.unit) for column in way.columns]
    if table.shape[1] != len(said) or not len(table):
        return way
    triads: dict[tuple[str, ...], list[int]] = {}
    for i, one in enumerate(said):
        if one is not None and one.kind == "a" and one.weak and not one.gain:
            triads.setdefault(one.label, []).append(i)
    sizes = {
        label: float(np.nanmedian(np.linalg.norm(table[:, three], axis=1)))
        for label, three in triads.items()
        if len(three) == len(AXES)
    }
    names = [*way.columns]
    for label, size in sizes.items():
        if size < SMALL * max(sizes.values()):
            for i in triads[label]:
                names[i] = names[i]._replace(name="")
    return Heading(names, way.skip)


def _are_as_long(acc: Array, gravity: Array) -> bool:
    """Whether accelerations (n, 3) usually are as long as gravity (n, 3)."""
    usual = [float(np.nanmedian(np.linalg.norm(x, axis=1))) for x in (acc, gravity)]
    return abs(usual[0] - usual[1]) < SAME * usual[1]


def _axes(columns: Sequence[Column], kind: str) -> list[int]:
    """Columns of the three axes of a kind; none where there are more or fewer."""
    said = [heading_meaning(column.name, column.unit) for column in columns]
    found = [i for i, one in enumerate(said) if one is not None and one.kind == kind]
    return found if len(found) == len(AXES) else []
