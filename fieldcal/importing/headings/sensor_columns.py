"""Columns whose names the file, or the form of its lines, completes."""

from __future__ import annotations

from fieldcal.importing.headings.heading import Column, Heading
from fieldcal.importing.words.heading_words import heading_meaning, words_in_name
from fieldcal.importing.words.sensor_words import AXES

OF_ANY = ("attr", "axis", "value", "values", "val", "data", "raw", "sensor", "double",
          "float")  # fmt: skip
"""Words beside an axis that say no sensor: ``attr_x``."""

NUMBERS = ("0", "1", "2")
"""In place of an axis, where values have no other name: ``double_values_0`` of AWARE's
table ``accelerometer`` (its client's list of columns of a file in CSV)."""


def of_sensor(sensor: str, column: Column) -> Column:
    """Column of which a bare axis, whose unit does not say it, is the sensor's."""
    bare = column.name.strip().strip('"').strip()
    axis = bare[:1].lower() in AXES and not bare[1:2].isalpha()
    if len(letter := [w for w in words_in_name(bare) if w not in OF_ANY]) == 1:
        axis |= letter[0] in AXES
        if bare != letter[0] and letter[0] in NUMBERS:
            return column._replace(name=f"{sensor} {AXES[int(letter[0])]}")
    said = heading_meaning(bare, column.unit)
    told = said is not None and bool(said.kind)
    if said is not None and said.kind == "v" and sensor == "acc":
        # of a file of gravity, which is part of the force
        return Column(column.place, f"{sensor} {said.axis}", said.unit or "")
    return column._replace(name=f"{sensor} {bare}" if axis and not told else bare)


def with_clock_column(heading: Heading, clock: int, name: str) -> Heading:
    """A heading with the name of the column of which the clock was read."""
    named = [
        Column("", name) if i == clock else column
        for i, column in enumerate(heading.columns)
    ]
    return Heading(named, heading.skip)
