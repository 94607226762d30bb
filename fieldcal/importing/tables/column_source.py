"""What a file in columns says of itself, and where its channels stand."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from fieldcal.core.samples import Array
from fieldcal.importing.headings.heading import Heading
from fieldcal.importing.read_options import ReadOptions


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
