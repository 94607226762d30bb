"""Tables of one sensor each, one below the other in a text.

    Accelerometer                      a title, or names that state the sensor
    Time (s),X (m/s^2),Y (m/s^2),Z (m/s^2)
    0.00,0.1,0.2,9.8
    …
    Gyroscope
    Time (s),X (rad/s),Y (rad/s),Z (rad/s)
    0.00,0.01,0.02,0.03

    sensor,time,x,y,z                  or a word in each row, of which the rows of one
    accelerometer,0.00,0.1,0.2,9.8     sensor stand below those of the other
    …
    gyroscope,0.00,0.01,0.02,0.03

    const float acc[][3] = {           or matrices in a program's source
      {0.1f, 0.2f, 9.8f},

A table of a sensor that comes again goes on.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.importing.text.matrix_rows import without_brackets
from fieldcal.importing.text.text_lines import MISSING
from fieldcal.importing.text.text_top import (
    find_separator,
    is_number,
    split_cells,
    with_points,
)
from fieldcal.importing.times.clock_text import ClockText, is_clock
from fieldcal.importing.words.file_names import sensor_of_file_name
from fieldcal.importing.words.heading_words import bare_axis, heading_meaning
from fieldcal.importing.words.name_and_unit import name_unit_splits
from fieldcal.importing.words.sensor_words import AXES

NARROWEST = 3
"""Columns of numbers that a row has at least."""

SENSOR = {"acc": "a", "gyr": "g"}
"""Kind of what a title calls so."""

UNNAMED = {len(names): names for names in (AXES, ("time", *AXES))}
"""Columns of rows behind a word or below a title, where no line names them."""

END_MARK = ";"
"""What may stand at the end of a row."""


@dataclass
class SensorBlock:
    """A table of one sensor.

    Attributes
    ----------
    title : what the line above its names says, or the word in its rows; or ""
    names : of its columns
    separator : of columns, None for spaces
    rows : cells of each row

    """

    title: str
    names: tuple[str, ...]
    separator: str | None
    rows: list[list[str]] = field(default_factory=list)

    @property
    def sensor(self) -> str:
        """Kind of the only sensor that it holds, "a" or "g"; "" of others."""
        said = [heading_meaning(name) for name in self.names]
        kinds = {one.kind for one in said if one is not None and one.axis}
        axes = {one[0] for one in map(bare_axis, self.names) if one is not None}
        if not kinds and axes >= {*AXES}:
            kinds = {SENSOR.get(sensor_of_file_name(self.title), "")}
        return kinds.pop() if len(kinds) == 1 and kinds <= {*SENSOR.values()} else ""

    @property
    def group(self) -> str:
        """Name of the group that its columns are."""
        called = {"a": "acc", "g": "gyro"}.get(self.sensor, "")
        titled = self.title if heading_meaning(f"{self.title}_x") else ""
        return (titled or called or self.title or "other").replace("/", " ")

    def arrays(self) -> Iterator[tuple[str, Array, str]]:
        """Columns of numbers: the name, behind that of the group, values, and unit."""
        cells = zip(*self.rows, strict=True)
        for name, column in zip(self.names, cells, strict=True):
            values = _numbers(column, self.separator)
            bare, unit = next(name_unit_splits(name, ""))
            if values is None or not bare:
                continue
            called = bare if unit else name
            named = called.replace("/", " ").strip()
            yield f"{self.group}/{named}", values, unit or ""


def sensor_blocks(lines: Iterable[str]) -> Iterator[SensorBlock]:
    """Tables of a text in their order, each as soon as its first row is known."""
    words: list[str] = []
    open_one: SensorBlock | None = None
    named: tuple[str, ...] = ()
    for line in without_brackets(lines):
        bare = line.rstrip().removesuffix(END_MARK)
        line = line if END_MARK in bare else bare
        separator = find_separator(line)
        cells = split_cells(line, separator)
        at = _place_of_word(cells, separator)
        if at is None:
            words.append(line)
            continue
        word = cells.pop(at) if at >= 0 else ""
        title = word or _title(words)
        above = _names(words, len(cells) + (at >= 0))
        if above is not None:
            named = (*above[:at], *above[at + 1 :]) if at >= 0 else above
        elif title and len(named) != len(cells):
            named = UNNAMED.get(len(cells), named)
        words = []
        goes_on = open_one is not None and len(open_one.names) == len(cells)
        if title or above is not None or not goes_on:
            if len(named) != len(cells):
                continue
            if open_one is None or (open_one.title, open_one.names) != (title, named):
                open_one = SensorBlock(title, named, separator)
                yield open_one
        if open_one is not None:
            open_one.rows.append(cells)


def joined_blocks(blocks: Iterable[SensorBlock]) -> list[SensorBlock]:
    """Tables of which those that go on are one, whole only when all are read."""
    found: dict[tuple[str, tuple[str, ...]], SensorBlock] = {}
    for one in [*blocks]:
        first = found.setdefault((one.title, one.names), one)
        if first is not one:
            first.rows += one.rows
    return [*found.values()]


def _place_of_word(cells: Sequence[str], separator: str | None) -> int | None:
    """Column of a row's only word, which names a sensor; -1 without, None of no row."""
    if len(cells) < NARROWEST:
        return None
    comma = separator != ","
    others = [
        i for i, cell in enumerate(cells)
        if not (is_number(cell, comma) or cell in MISSING or is_clock(cell))
    ]  # fmt: skip
    numbers = sum(is_number(cell, comma) for cell in cells)
    if numbers < NARROWEST or len(others) > 1:
        return None
    if not others:
        return -1
    return others[0] if _is_sensor(cells[others[0]]) else None


def _is_sensor(word: str) -> bool:
    said = heading_meaning(f"{word}_x")
    return bool(sensor_of_file_name(word)) or (said is not None and said.kind != "t")


def _names(words: Sequence[str], width: int) -> tuple[str, ...] | None:
    """Names of as many columns as a row has, in the last line that holds them."""
    for line in reversed(words):
        bare = line.lstrip("#%/ ")
        cells = split_cells(bare, find_separator(bare))
        if len(cells) == width and all(cell[:1].isalpha() for cell in cells):
            return tuple(cells)
    return None


def _title(words: Sequence[str]) -> str:
    """The last line above the names that names a sensor; "" without."""
    for line in reversed(words):
        bare = " ".join(line.strip("#%/=*-[]<>:\"' \t,;").split())
        if find_separator(bare) is None and _is_sensor(bare):
            return bare
    return ""


def _numbers(cells: Sequence[str], separator: str | None) -> Array | None:
    """Numbers (n,) of cells; None where they are none."""
    if all(is_clock(cell) for cell in cells[:2]):
        clock = ClockText()
        read = (clock.seconds(cell) for cell in cells)
        return np.array([np.nan if since is None else since for since in read])
    point = str if separator == "," else with_points
    try:
        return np.array(
            [np.nan if cell in MISSING else float(point(cell)) for cell in cells]
        )
    except ValueError:
        return None
