"""Columns of a table of means that hold how much the samples of each scattered."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from fieldcal.importing.headings.heading import Column
from fieldcal.importing.words.heading_words import (
    SCATTER,
    bare_axis,
    heading_meaning,
    words_in_name,
)

COUNTS = ("n", "count", "samples", "num", "number", "n_samples")
"""Names of a column that holds how many samples a mean is of."""


def scatter_columns(columns: Sequence[Column]) -> Mapping[str, int]:
    """Columns that hold the scatter of a channel, or "n", by the channel.

    A scatter that names no sensor, ``x_std``, is of the only one that there is.
    """
    found: dict[str, int] = {}
    kinds = {
        said.kind for c in columns if (said := heading_meaning(c.name, c.unit))
    } & {*"ag"}
    for i, column in enumerate(columns):
        if column.name.strip().lower() in COUNTS:
            found["n"] = i
        elif (said := heading_meaning(column.name, column.unit)) and said.kind in (
            "a",
            "g",
        ):
            if set(said.label) & set(SCATTER):
                found[said.kind + said.axis] = i
        elif (alone := bare_axis(words_in_name(column.name))) and len(kinds) == 1:
            if set(alone[1]) & set(SCATTER):
                found[min(kinds) + alone[0]] = i
    return found
