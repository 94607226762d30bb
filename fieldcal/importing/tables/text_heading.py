"""What stands above the numbers of a text, with what its form and its name say."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.importing.columns import SKIP
from fieldcal.importing.headings.heading import Column, Heading
from fieldcal.importing.headings.sensor_columns import of_sensor, with_clock_column
from fieldcal.importing.tables.column_times import keeps_growing
from fieldcal.importing.text.text_form import TextForm
from fieldcal.importing.text.text_forms import CLOCK
from fieldcal.importing.text.text_top import headings_above
from fieldcal.importing.words.file_names import SENSOR
from fieldcal.importing.words.sensor_words import AXES


class ReadHeadings(NamedTuple):
    """Headings of a text.

    Attributes
    ----------
    ways : in which its lines may be read, the likeliest first
    says : what the user must know of them, a sentence each
    told_by : what says the sensor, where it is not the names of the columns alone

    """

    ways: list[Heading]
    says: list[str]
    told_by: str = ""


class TextHeading:
    """The lines above the numbers of a text.

    Parameters
    ----------
    lines : at its top
    numbers : (n, k) of its first rows; nan where a cell is none
    separator : of columns, where the user says it

    """

    def __init__(
        self, lines: Sequence[str], numbers: Array, separator: str | None
    ) -> None:
        self._lines, self._numbers, self._separator = lines, numbers, separator

    def read(self, forms: Sequence[TextForm], said: str, named: str) -> ReadHeadings:
        """Read them, with the names that the form of the text says.

        Parameters
        ----------
        forms : of the text
        said, named : sensor that something else says, and that the file is called by;
            "" for none

        """
        says: list[str] = []
        found = headings_above(self._lines, self._separator)
        for form in forms:
            says += [form.says] if form.says else []
            if form.names:
                found = [Heading([Column("", name) for name in form.names], SKIP)]
            if form.clock is not None:
                found = [with_clock_column(one, form.clock, CLOCK) for one in found]
        found = [one for way in found if (one := self._fitted(way)) is not None]
        sensor = said or named
        if not sensor:
            return ReadHeadings(found, says)
        told_by = "the names of its columns and of the file"
        if not found and (names := self._three_axes()):
            told_by = "the name of the file"
            found = [Heading([Column("", name) for name in names], SKIP)]
        ways = [
            Heading([of_sensor(sensor, c) for c in way.columns], way.skip)
            for way in found
        ]
        if said or ways == found:
            return ReadHeadings(ways, says)
        says.append(
            f"its axes are those of the {SENSOR[sensor]}, as the file is called"
        )
        return ReadHeadings(ways, says, told_by)

    def _three_axes(self) -> tuple[str, ...]:
        """Names for three columns alone, or behind one that is their time."""
        width = self._numbers.shape[1]
        grows = [keeps_growing(column) for column in self._numbers.T]
        if width == len(AXES) + 1 and grows[0] and not any(grows[1:]):
            return ("t", *AXES)
        return AXES if width == len(AXES) else ()

    def _fitted(self, way: Heading) -> Heading | None:
        """A heading as wide as the rows; None if its names stand over other columns.

        Lines may end with a separator, those of names or those of numbers.
        """
        table, names = self._numbers, [*way.columns]
        width = table.shape[1]
        while len(names) > width and not names[-1].name and width:
            names.pop()
        if len(names) == width - 1 and np.isnan(table[:, -1]).all():
            names.append(Column("", ""))
        return Heading(names, way.skip) if len(names) == width or not width else None
