"""Lines of several sensors that a number tells apart, as enumerations of programs do.

    % Accelerometer = 0                what a number stands for is said above
    % Gyroscope = 1
    TimeStamp;X-Axis;Y-Axis;Z-Axis;Sensor Type
    12;0.1;0.2;0.9;0
    13;0.5;0.1;0.3;1
    sensor_id,timestamp,x,y,z          or is Android's, if gravity is where it says

The name of the sensor takes the place of the number.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Self

import numpy as np

from fieldcal.core.gravity import G0
from fieldcal.importing.text.tagged_lines import SENSORS
from fieldcal.importing.text.text_form import Reader, TextForm
from fieldcal.importing.text.text_top import find_separator, is_number, split_cells
from fieldcal.importing.words.device_names import tells_devices
from fieldcal.importing.words.heading_words import words_in_name
from fieldcal.importing.words.sensor_words import AXES

NAMES = ("sensor", "type", "id", "code", "kind")
"""Words of the name of such a column, of which one of the first two is there."""

ANDROID = {"1": "accelerometer", "2": "magnetometer", "4": "gyroscope", "9": "gravity",
           "10": "linear acceleration", "11": "rotation vector"}  # fmt: skip
"""Numbers of Android's sensors, by its class Sensor."""

FEWEST, MOST = 20, 8
"""Lines of each number among the first, and numbers."""

NEAR_G = 0.2
"""Part by which the median length of a force in m/s^2 may differ from gravity."""

_LEGEND = re.compile(r"[#%/*\s]*([^\W\d][\w ]*?)\s*[=:]\s*(\d+)\W*")


class SensorCodes(TextForm):
    """Lines with a number for the sensor.

    Parameters
    ----------
    separator : of columns
    place : column of the number
    words : that stand for numbers

    """

    def __init__(
        self, separator: str | None, place: int, words: Mapping[str, str]
    ) -> None:
        self._separator, self._place, self._words = separator, place, words

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if a line of names has such a column whose numbers are known."""
        seen = Counter(find_separator(line) for line in lines)
        parted = separator or (seen.most_common(1)[0][0] if seen else None)
        rows = [split_cells(line.lstrip("#%/ "), parted) for line in lines]
        width = len(rows[-1]) if rows else 0
        above = [row for row in rows if _is_named(row, width)]
        names = above[-1][:width] if above else []
        places = [i for i, name in enumerate(names) if _tells_sensors(name)]
        if not places:
            return None
        numbers = [row for row in rows if len(row) == width and _all_numbers(row)]
        for i in places:
            words = _words(lines, numbers, i)
            if words and not _several_devices(names, numbers, places):
                return cls(parted, i, words)
        return None

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""
        part = self._separator or " "

        def one(line: str) -> str:
            row = split_cells(line.lstrip("#%/ "), self._separator)
            if len(row) <= self._place or len(row) < len(AXES):
                return line
            cell = row.pop(self._place)
            while row and not row[-1]:
                row.pop()
            return part.join([self._words.get(cell, cell), *row])

        return lambda lines: [one(line) for line in lines]


def _all_numbers(row: Sequence[str]) -> bool:
    return all(is_number(cell, comma=False) for cell in row)


def _is_named(row: Sequence[str], width: int) -> bool:
    """Whether a row holds as many names as there are columns, and maybe an end."""
    named = [cell[:1].isalpha() for cell in row[:width]]
    return len(named) == width > len(AXES) and all(named) and not any(row[width:])


def _tells_sensors(name: str) -> bool:
    words = words_in_name(name)
    return {*words} <= {*NAMES} and bool({*words} & {*NAMES[:2]})


def _words(
    lines: Sequence[str], rows: Sequence[Sequence[str]], place: int
) -> dict[str, str]:
    """What the numbers of a column stand for; nothing if that is not known."""
    many = Counter(row[place] for row in rows)
    if not 1 < len(many) <= MOST or min(many.values()) < FEWEST:
        return {}
    said = {one[2]: one[1] for line in lines if (one := _LEGEND.fullmatch(line))}
    if _are_both(said.get(code, "") for code in many):
        return said
    known = _are_both(ANDROID.get(code, "") for code in many)
    return {**ANDROID} if known and _holds_gravity(rows, place, "1") else {}


def _are_both(words: Iterable[str]) -> bool:
    """Whether words name an accelerometer and a gyroscope."""
    there = [*words]
    return all(any(SENSORS[kind].search(word) for word in there) for kind in ("a", "g"))


def _holds_gravity(rows: Sequence[Sequence[str]], place: int, code: str) -> bool:
    """Whether three columns side by side of lines with a number are as long as g."""
    own = np.array([row for row in rows if row[place] == code], dtype=float)
    for i in range(own.shape[1] - 2):
        if not i <= place < i + len(AXES):
            length = np.median(np.linalg.norm(own[:, i : i + len(AXES)], axis=1))
            if abs(length / G0 - 1) < NEAR_G:
                return True
    return False


def _several_devices(
    names: Sequence[str], rows: Sequence[Sequence[str]], places: Sequence[int]
) -> bool:
    """Whether another column tells devices apart, whose lines must not be paired."""
    others = [i for i, name in enumerate(names) if tells_devices(name)]
    many = [len({row[i] for row in rows}) for i in {*others, *places}]
    return sum(n > 1 for n in many) > 1
