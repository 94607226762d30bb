"""Whether the accelerations of a table lack gravity that has columns of its own."""

from __future__ import annotations

from collections.abc import Sequence

from fieldcal.core.samples import Array
from fieldcal.importing.headings.heading import Column, Heading
from fieldcal.importing.times.gravity_sum import lacks_gravity
from fieldcal.importing.words.heading_words import heading_meaning

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
    acc, gravity = (_axes(way.columns, kind) for kind in "av")
    if not (acc and gravity) or table.shape[1] != len(way.columns):
        return way
    if not lacks_gravity(table[:, acc], table[:, gravity]):
        return way
    names = [*way.columns]
    for i in acc:
        names[i] = names[i]._replace(name=f"{USER} {names[i].name}")
    return Heading(names, way.skip)


def _axes(columns: Sequence[Column], kind: str) -> list[int]:
    """Columns of the three axes of a kind; none where there are more or fewer."""
    said = [heading_meaning(column.name, column.unit) for column in columns]
    found = [i for i, one in enumerate(said) if one is not None and one.kind == kind]
    return found if len(found) == len("xyz") else []
