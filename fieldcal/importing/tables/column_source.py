"""What a file in columns says of itself, and where its channels stand."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.importing.headings.heading import Heading
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.tables.scatter_columns import scatter_columns
from fieldcal.importing.units.gravity_size import are_means
from fieldcal.session.units import UNSCALED


class ColumnSource(Protocol):
    """Members of a file of columns that finding its times uses.

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


def column_numbers(source: ColumnSource, wanted: ReadOptions) -> dict[str, int]:
    """Number of each channel's column among those of `beginning`."""
    names = [c.partition("=") for c in wanted.columns]
    if not any(place for _, _, place in names):
        return {name: i for i, (name, _, _) in enumerate(names)}
    places = [c.place for way in source.heading() for c in way.columns]
    return {n: places.index(p) for n, _, p in names if p in places}


def holds_means(source: ColumnSource, wanted: ReadOptions) -> bool:
    """Whether rows are means, read with these options."""
    table, at = source.beginning(), column_numbers(source, wanted)
    if not len(table):
        return False
    if not {"ax", "gx"} & set(at):
        return False
    if "t" not in at and _says_means(source, table):
        # on a table that turns, the same direction and rates come again and again
        return True
    if not {"ax", "ay", "az"} <= set(at):
        return wanted.means
    t = table[:, at["t"]] * wanted.time_scale if "t" in at else None
    acc, gyr = ([at[k + x] for x in "xyz" if k + x in at] for k in "ag")
    rates = rates_in_degrees(table, gyr, wanted)
    return wanted.means or are_means(table[:, acc], t, rates)


def _says_means(source: ColumnSource, table: Array) -> bool:
    """Whether columns beside the outputs hold how much the samples of a row scatter."""
    fits = (way for way in source.heading() if len(way.columns) == table.shape[1])
    way = next(fits, None)
    return way is not None and bool({*scatter_columns(way.columns)} - {"n"})


def rates_in_degrees(
    table: Array, at: Sequence[int], wanted: ReadOptions
) -> Array | None:
    """Rates (n, 3) of three columns, deg/s; as they are where nobody says their unit.

    None where there are no three.
    """
    if len(at) != len("xyz") or not len(table):
        return None
    said = bool(wanted.gyr_unit) and wanted.gyr_unit not in UNSCALED
    scale = np.rad2deg(wanted.gyr_scale) if said else 1.0
    rates: Array = table[:, list(at)] * scale
    return rates
