"""Lines of several kinds in one text, each with a word that says which.

    IMU,0.01,0.1,0.2,9.8,0,0,0         those of the IMU alone are taken
    GPS,0.01,48.1,11.5,512
    ACCE;1.234;0.1;0.2;9.8             accelerometer and gyroscope go together
    GYRO;1.235;0.01;0.02;0.03
    $COL,IMU,time,wx,wy,wz             names, and units, of the lines $IMU,0.01,...
    0.1  0.2  9.8  G                   the unit tells the sensor; without times, lines
    1.2  3.4  5.6  o/s                 of both go together as they come in turn

A line of the gyroscope goes with the nearest of the accelerometer; nothing is
interpolated.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple, Self

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.importing.text.nearest_lines import NearestLines
from fieldcal.importing.text.text_form import MOSTLY, Reader, TextForm
from fieldcal.importing.text.text_top import find_separator, is_number, split_cells
from fieldcal.importing.times.clock_ratio import clock_ratio, say_apart, say_ratio
from fieldcal.importing.words.heading_units import parse_unit, sensor_of_unit
from fieldcal.importing.words.heading_words import (
    bare_axis,
    heading_meaning,
    words_in_name,
)

SENSORS = {
    "a": re.compile(r"acc", re.IGNORECASE),
    "g": re.compile(r"gyr|rotation|angular", re.IGNORECASE),
    "imu": re.compile(r"imu|mpu", re.IGNORECASE),
}
"""What the word of a kind holds, by what its lines hold."""

OTHER_QUANTITY = re.compile(r"lin|user|free|magn|vector", re.IGNORECASE)
"""What it holds if they lack gravity, are of another sensor or an attitude."""

PLACES = 3
"""Columns at the beginning of which one is the word, or else the last."""

MIN_LINES = 2
"""Lines of a kind that is none by chance."""

SIGN = "$"
"""What may stand before the word, as in messages of receivers."""

_WORD = re.compile(r"(?:\$?[^\W\d]|[°º]/)[^,;\t]*")


class LineKind(NamedTuple):
    """Lines of one kind.

    Attributes
    ----------
    word : that they begin with
    width : columns
    names : of the columns, where a line says them; else empty

    """

    word: str
    width: int
    names: tuple[str, ...]


class TaggedLines(TextForm):
    """Lines of an IMU among others, or of its two sensors in turn."""

    gathers = True

    def __init__(
        self,
        separator: str | None,
        place: int,
        acc: LineKind,
        gyr: LineKind | None,
        time: int,
        ratio: float = 1.0,
    ) -> None:
        self._separator, self._place = separator, place
        self._acc, self._gyr, self._time = acc, gyr, time
        self._ratio = ratio
        self.names = _named(acc, "acc" if gyr else "")
        if gyr is not None and self.names:
            own = _named(gyr, "gyr")
            self.names += tuple(self._of_gyroscope(own)) if own else ()
        what = f"of its lines, those that say {acc.word}"
        if gyr is not None:
            what += f" are taken, each with the nearest that says {gyr.word}"
        told = say_ratio(ratio, gyr.word) if gyr is not None else []
        self.says = "; ".join([what, *told]) if gyr is not None else f"{what} are taken"

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if most lines begin with one of several words.

        Raises
        ------
        InputError
            If the lines of both sensors have no times in common.

        """
        seen = Counter(find_separator(line) for line in lines)
        parted = separator or (seen.most_common(1)[0][0] if seen else None)
        rows = [split_cells(line, parted) for line in lines]
        last = len(rows[-1]) - 1 if rows else 0
        places = (*range(PLACES), *([last] if last >= PLACES else []))
        place = next((i for i in places if _is_word(rows, i)), None)
        if place is None:
            return None
        found = _kinds(rows, place)
        acc, gyr = _chosen(found)
        # a word at the end may say what was done; of sensors it tells both
        if acc is None or (place >= PLACES and gyr is None):
            return None
        here = [row for row in rows if len(row) == acc.width and row[place] == acc.word]
        time = next((i for i in range(acc.width) if _grows(row[i] for row in here)), -1)
        if gyr is not None and (
            (time < 0 and not _in_turn(rows, place, (acc, gyr)))
            or _are_apart(rows, place, (acc, gyr), time)
        ):
            return None
        ratio = 1.0
        if gyr is not None and time >= 0:
            t, late = (_times(rows, place, kind, time) for kind in (acc, gyr))
            known = clock_ratio(t, late, part=True)
            if known is None:
                raise InputError(say_apart(t, late, acc.word, gyr.word))
            ratio = known
        return cls(parted, place, acc, gyr, time, ratio)

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""
        here = {self._place, self._time} - {-1}
        pairs = NearestLines(self._gyr.width - len(here) if self._gyr else 0)
        turns = Counter[str]()

        def time(word: str, row: Sequence[str]) -> float | None:
            """Time of a line, or which it is of those with its word."""
            if self._time < 0:
                turns[word] += 1
                return float(turns[word])
            cell = row[self._time]
            return float(cell) if is_number(cell, False) else None

        def read(lines: Sequence[str]) -> list[str]:
            found = [] if lines else pairs.rest()
            for line in lines:
                row = split_cells(line, self._separator)
                word = row[self._place] if len(row) > self._place else ""
                if self._gyr is None:
                    own = word == self._acc.word and is_number(row[self._time], False)
                    found += [row] if own else []
                    continue
                kind = (word, len(row))
                own = kind == (self._gyr.word, self._gyr.width)
                if not own and word != self._acc.word:
                    continue
                if (t := time(word, row)) is None:
                    continue
                if own:
                    found += pairs.rate(t * self._ratio, self._of_gyroscope(row))
                else:
                    found += pairs.force(t, row)
            return [(self._separator or " ").join(row) for row in found]

        return read

    def _of_gyroscope(self, row: Sequence[str]) -> list[str]:
        """Cells of a line of the gyroscope, but its word and time."""
        return [c for i, c in enumerate(row) if i not in (self._place, self._time)]


def is_of_sensor(word: str, sensor: str, among: Collection[str]) -> bool:
    """Whether a word among others names a sensor, of `SENSORS`.

    It may be a unit of its values, or its first letter. A lone g is either: beside a
    unit of rates it is one of forces, and beside an a it stands for the gyroscopes.

    >>> is_of_sensor("G", "a", ["G", "o/s"]), is_of_sensor("G", "g", ["A", "G", "M"])
    (True, True)
    """
    if SENSORS[sensor].search(word):
        return True
    if any(sensor_of_unit(one) == "g" for one in among):
        return sensor_of_unit(word) == sensor
    letters = {one.lower().lstrip(SIGN) for one in among}
    return {*"ag"} <= letters and word.lower().lstrip(SIGN) == sensor


def _in_turn(
    rows: Sequence[Sequence[str]], place: int, kinds: tuple[LineKind, LineKind]
) -> bool:
    """Whether lines of two kinds always follow each other."""
    words = [row[place] for row in rows if len(row) > place]
    both = [word for word in words if word in {kind.word for kind in kinds}]
    return len(both) > len("ag") and all(a != b for a, b in pairwise(both))


def _are_apart(
    rows: Sequence[Sequence[str]],
    place: int,
    kinds: tuple[LineKind, LineKind],
    time: int,
) -> bool:
    """Whether rows of two kinds have their numbers in columns of their own.

    Such rows are those of one table, whose names say both sensors.
    """
    if kinds[0].width != kinds[1].width:
        return False
    filled: list[set[int]] = [set(), set()]
    for row in rows:
        for kind, columns in zip(kinds, filled, strict=True):
            if len(row) == kind.width and row[place] == kind.word:
                columns |= {i for i, c in enumerate(row) if is_number(c, False)}
    blank = [{i for i in range(kinds[0].width) if i != time} - one for one in filled]
    own = (filled[0] & blank[1], filled[1] & blank[0])
    return min(map(len, own)) >= len("xyz")


def _times(
    rows: Sequence[Sequence[str]], place: int, kind: LineKind, time: int
) -> Array:
    """Times (n,) of lines of a kind."""
    own = (r[time] for r in rows if len(r) == kind.width and r[place] == kind.word)
    return np.array([float(cell) for cell in own if is_number(cell, False)])


def _is_word(rows: Sequence[Sequence[str]], i: int) -> bool:
    """Whether most rows have a word in a column, and numbers beside it."""
    said = [row for row in rows if len(row) > i and _WORD.fullmatch(row[i])]
    beside = [row for row in said if sum(is_number(c, False) for c in row) > 1]
    return len(beside) > MOSTLY * len(rows)


def _kinds(rows: Sequence[Sequence[str]], place: int) -> list[LineKind]:
    """Kinds of lines by their word and width, the commonest first."""
    whole = [row for row in rows if len(row) > place]
    words = [row for row in whole if not any(is_number(c, False) for c in row)]
    numbers = [row for row in whole if any(is_number(c, False) for c in row)]
    seen = Counter((row[place], len(row)) for row in numbers)
    usual = [kind for kind, many in seen.most_common() if many >= MIN_LINES]
    found = []
    for word, width in usual:
        # "# Header: IMU" ends with the word; a line without any is said of all kinds
        said = [(row[place].split(" ")[-1].lstrip("#%/"), row)
                for row in words if len(row) == width]  # fmt: skip
        own = [row for first, row in said if first == word]
        own += [row for first, row in said if first not in dict(usual)]
        own += _described(words, word.lstrip(SIGN), width)
        found.append(LineKind(word, width, tuple(own[0]) if own else ()))
    return found


def _described(
    words: Sequence[Sequence[str]], word: str, width: int
) -> Iterator[Sequence[str]]:
    """Names of the columns of a kind by a line whose second word is its own.

    A second line of this kind may say the units.
    """
    said = [row[1:] for row in words if len(row) == width + 1 and row[1] == word]
    units = [row for row in said[1:] if any(map(parse_unit, row))]
    if said and units:
        yield [f"{name} [{unit}]" if parse_unit(unit) else name
               for name, unit in zip(said[0], units[0], strict=True)]  # fmt: skip
    elif said:
        yield said[0]


def _chosen(kinds: Sequence[LineKind]) -> tuple[LineKind | None, LineKind | None]:
    """Kinds of which the lines are taken: of the forces or of all, and of the rates."""
    if len({kind.word for kind in kinds}) < len("ab"):
        return None, None
    plain = [kind for kind in kinds if not OTHER_QUANTITY.search(kind.word)]
    words = {kind.word for kind in plain}
    of = {s: [k for k in plain if is_of_sensor(k.word, s, words)] for s in SENSORS}
    if of["imu"] and not of["a"]:
        # imu1 and imu2 alone are devices: what tells those apart takes them all
        alike = {(re.sub(r"\d+", "", kind.word), kind.width) for kind in kinds}
        return (of["imu"][0], None) if len(alike) > 1 else (None, None)
    if of["a"]:
        first = of["a"][0]
        gyr = [k for k in of["g"] if not is_of_sensor(k.word, "a", words)]
        return first, (gyr[0] if gyr else None)
    # words of equal lines say what was done, or which device it was
    wide = [kind for kind in kinds if kind.width > len("txyz")]
    return (
        (wide[0], None) if len({k.width for k in kinds}) > 1 and wide else (None, None)
    )


def _named(kind: LineKind, sensor: str) -> tuple[str, ...]:
    """Names of the columns of a kind, bare axes with their sensor."""
    bare = [bare_axis(words_in_name(name)) is not None for name in kind.names]
    said = [heading_meaning(name) for name in kind.names]
    if not any(bare) and not any(s and s.kind in "ag" for s in said):
        return ()
    return tuple(f"{sensor} {name}" if axis and sensor else name
                 for name, axis in zip(kind.names, bare, strict=True))  # fmt: skip


def _grows(column: Iterable[str]) -> bool:
    """Whether numbers never step back and do not stay."""
    values = [float(cell) for cell in column if is_number(cell, False)]
    pairs = zip(values, values[1:], strict=False)
    return len(values) > 1 and values[-1] > values[0] and all(a <= b for a, b in pairs)
