"""The top of a text file: where its numbers begin, what parts them, what names them.

Names may stand in one line, with units in the line below, or in two lines of which the
first says the sensor of several columns (``Accelerometer,,,Gyroscope,,``) and the
second the axis. A line such as ``Fs,100`` or ``# Sample rate: 100 Hz`` says the rate.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.importing.columns import SKIP
from fieldcal.importing.headings.heading import Column, Heading
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.text.text_lines import split_quoted
from fieldcal.importing.words.heading_units import parse_unit

SEPARATORS = (";", "\t", ",")
"""Between columns; a comma in a line with one of the others is a decimal comma."""

ABOVE = 4
"""Lines above the numbers among which their names are looked for."""

LATEST = 50
"""Lines below the first of numbers among which their names are looked for."""

NARROWEST = 3
"""Fewest columns by which the width of a table is told."""

FEWEST = 2
"""Fewest columns that names are looked for of: a time and a thermometer."""

MOST_COLUMNS = 5000
"""Columns of a table; a line with more is none of names."""

FULL = 50
"""Lines at the top by which the width of a row is judged."""

NUMBERS = 0.5
"""Share of the cells of a line that are numbers, where names of columns are not."""

_AXIS = re.compile(r"(.*[^\W_].*?|.*\(|[A-Za-z])([xyzXYZ])(\)?\s*(?:[\[({].*[\])}])?)")
"""A name that ends with an axis, and maybe a unit."""

_SENSOR_AND_UNIT = re.compile(r"(Acc\w*|Gyr\w*)(\s*[\[(].*[\])])?", re.IGNORECASE)
"""The name of a sensor alone, and maybe a unit."""

_DESCRIBED = re.compile(r"%\w+\(([^()]*)\)")
"""A column as loggers describe it by its type and name: ``%float(RawGyroX)``."""

_RATE_WITHIN = re.compile(
    r"(?:\bat|rate|frequency|freq|odr|fs)\b[\s:=_,]*(?:is|of)?\s*([0-9]+(?:\.[0-9]+)?)\s*hz\b",
    re.IGNORECASE,
)
"""A rate that stands among other words of a line."""

_RATE = re.compile(
    r"[#%/\s\"]*(?:fs|(?:sample|sampling|output|update|data|logging|"
    r"measurement)[ _]*"
    r"(?:rate|frequency|freq)|frequency|odr)\b[ _,]*(?:\(?hz\)?)?\s*[:=,;\t _]+\s*\"?"
    r"([0-9]+(?:\.[0-9]+)?)\s*(?:hz)?\W*",
    re.IGNORECASE,
)


_STEP = re.compile(
    r"[#%/\s\"]*(?:delta[ _]?x|dt|(?:sample|sampling|time|logging)[ _]*"
    r"(?:interval|period|step))\b[ _]*(?:\(?(s|ms|us)\)?)?\s*[:=;,\t ]+\s*\"?"
    r"([0-9]+[.,]?[0-9]*(?:[eE][-+]?[0-9]+)?)(?:[;\t ]+\2)*\s*(s|ms|us)?\W*",
    re.IGNORECASE,
)
"""The time from row to row, as ``Delta_X`` of LabVIEW, once for each column."""

_SECONDS = {"": 1.0, "s": 1.0, "ms": 1e-3, "us": 1e-6}


def find_separator(line: str) -> str | None:
    """Return the separator of the columns of a line; None for spaces."""
    return next((s for s in SEPARATORS if s in line), None)


_POINTS = re.compile(r"(?<=\d)\.(?=\d{3}(?:\.\d{3})*,\d)")
_COMMAS = re.compile(r"(?<=\d),(?=\d{3}(?:,\d{3})*\.\d)")
"""Signs between thousands, where the other one is that of the decimals."""


def with_points(text: str) -> str:
    """Numbers with decimal commas as numbers with points, without thousands' signs.

    >>> with_points("1,5;-1.023,32;1,023.32")
    '1.5;-1023.32;1023.32'
    """
    if "." in text and "," in text:
        text = _COMMAS.sub("", _POINTS.sub("", text))
    return text.replace(",", ".")


def is_number(cell: str, comma: bool) -> bool:
    """Whether a cell is a number, where a comma is a decimal comma or no part of it.

    Python reads 1_000 as one, which of files is a word: ``260314_101530``.
    """
    if "_" in cell:
        return False
    try:
        float(with_points(cell) if comma else cell)
    except ValueError:
        return False
    return True


def split_cells(line: str, separator: str | None) -> list[str]:
    """Cells of a line, without spaces and quotes about them."""
    if '"' not in line:
        return [*map(str.strip, line.split(separator))]
    cells = split_quoted(line, separator) if separator else line.split()
    return [cell.strip().strip('"').strip() for cell in cells]


def _count_cells(line: str, separator: str | None) -> int:
    """How many cells a line has, which is seen sooner than what they are."""
    if separator is None or '"' in line:
        return len(split_cells(line, separator))
    return line.count(separator) + 1


def first_numbers(lines: Sequence[str], separator: str | None) -> int:
    """Which of the lines is the first of numbers; how many there are if none is."""
    parted = [separator or find_separator(line) for line in lines]
    widths = [_count_cells(line, s) for line, s in zip(lines, parted, strict=True)]
    many = Counter(wide for wide in widths if wide >= NARROWEST)
    # a line into which another broke is wider than all others
    width = max(many, key=lambda n: (many[n], n)) if many else max(widths, default=0)
    for i, (line, s) in enumerate(zip(lines, parted, strict=True)):
        row = split_cells(line, s)
        said = [cell for cell in row if cell]
        if len(row) < min(NARROWEST, width) or not said:
            continue
        numbers = sum(is_number(cell, s != ",") for cell in said)
        # one that lacks a cell, as a setting does, is no row by itself
        alike = widths[i + 1 : i + 2] == [len(row)]
        wide = s is None or len(row) >= width - alike
        enough = numbers > NUMBERS * len(said) and numbers >= min(NARROWEST, width)
        if enough and wide and not _numbers_columns(said):
            return i
    return len(lines)


def _numbers_columns(cells: Sequence[str]) -> bool:
    """Whether cells number the columns from 1 on, as loggers of cars write it."""
    return len(cells) > NARROWEST and [*cells] == [
        str(i + 1) for i in range(len(cells))
    ]


def count_top_lines(
    lines: Sequence[str], wanted: ReadOptions, use: Sequence[int]
) -> int:
    """How many lines at the top hold something else than numbers; -1 if all do.

    Parameters
    ----------
    lines : at the top
    wanted : columns of the text, and its separator where the user says it
    use : numbers of the columns that are read

    """
    if wanted.skip is not None:
        return wanted.skip
    parted = [wanted.separator or find_separator(line) for line in lines]
    rows = [line.split(s) for line, s in zip(lines, parted, strict=True)]
    width, full = len(wanted.columns), max(map(len, rows[:FULL]), default=0)
    for i, (row, separator) in enumerate(zip(rows, parted, strict=True)):
        said = [row[j].strip() for j in use if j < len(row)]
        # a number alone, as of a rate, is no row
        bare = separator is None and len(row) > len(use) / 2
        # "% Number of channels = 8" has one where a column is wanted
        bare = bare and sum(is_number(c, True) for c in row) > NUMBERS * len(row)
        whole = bare or len(row) in (full, width)
        numbers = all(is_number(cell, separator != ",") for cell in said if cell)
        counted = _numbers_columns(split_cells(lines[i], separator))
        if whole and any(said) and numbers and not counted:
            return i
    return -1


def headings_above(lines: Sequence[str], separator: str | None) -> list[Heading]:
    """Lines above the numbers, read as headings in several ways."""
    first = first_numbers(lines, separator)
    below = next(iter(lines[first : first + 1]), "")
    tops = [line.lstrip("#%/ ") for line in _above(lines[:first], below, separator)]
    # who listens before the device starts has rows above the names
    tops += [line for line in lines[first : first + LATEST] if _all_words(line)]
    rows = [
        _DESCRIBED.findall(line) or _names_above(line, below, separator)
        for line in tops
    ]
    found = [Heading(way, SKIP) for way in _ways(rows)]
    return [one for one in found if FEWEST <= len(one.columns) <= MOST_COLUMNS]


def _above(lines: Sequence[str], below: str, separator: str | None) -> list[str]:
    """Lines above the numbers that may name columns: the last, and those as wide.

    Lines of marks, ``*DATA`` below ``*UNIT``, may stand between names and numbers.
    """
    parted = separator or find_separator(below)
    width = len(split_cells(below, parted))
    begin = len(lines) - ABOVE
    return [
        line for i, line in enumerate(lines)
        if i >= begin or (width >= NARROWEST and parted is not None
                          and len(split_cells(line, parted)) == width)
    ]  # fmt: skip


def _names_above(line: str, below: str, separator: str | None) -> list[str]:
    """Cells of a line of names; a unit such as ``[-90;90]`` in one parts none."""
    parted = separator or find_separator(below)
    cells = split_cells(line, parted)
    if parted is not None and len(cells) == len(split_cells(below, parted)):
        return cells
    return split_cells(line, separator or find_separator(line))


def _all_words(line: str) -> bool:
    """Whether all cells of a line are words."""
    row = split_cells(line, find_separator(line))
    return len(row) > 2 and all(cell[:1].isalpha() for cell in row)


def _ways(rows: Sequence[Sequence[str]]) -> Iterator[list[Column]]:
    for i, row in enumerate(rows):
        parts = [[part.strip('" ') for part in cell.split("|")] for cell in row]
        if len(row) > 2 and all(len(part) > 2 for part in parts):
            # RaceCapture: name, unit, range and rate of each channel
            yield [Column("", name, unit) for name, unit, *_ in parts]
            continue
        yield [Column("", name) for name in row]
        if (filled := _fill_sensor_names(row)) != [*row]:
            yield [Column("", name) for name in filled]
        if i + 1 == len(rows) or len(rows[i + 1]) != len(row):
            continue
        below = rows[i + 1]
        units = [parse_unit(cell) for cell in below]
        if any(units):
            pairs = zip(row, below, strict=True)
            yield [Column("", name, unit) for name, unit in pairs]
        above = ""
        joined = []
        for name, under in zip(row, below, strict=True):
            above = name or above
            joined.append(Column("", f"{above} {under}"))
        yield joined


def _fill_sensor_names(row: Sequence[str]) -> list[str]:
    """Names of which an axis alone belongs to the one before: ``acc_x,y,z``.

    >>> _fill_sensor_names(["t", "Accel (z) [g]", "(x)", "(y)", "gx", "y", "z"])
    ['t', 'Accel (z) [g]', 'Accel (x) [g]', 'Accel (y) [g]', 'gx', 'gy', 'gz']
    >>> _fill_sensor_names(["cts", "Gyroscope [rad/s]", "1", "2"])
    ['cts', 'Gyroscope x [rad/s]', 'Gyroscope y [rad/s]', 'Gyroscope z [rad/s]']
    """
    row = _with_numbered_axes(row)
    found: list[str] = []
    for name in row:
        bare = re.fullmatch(r"\(?([xyzXYZ])\)?", name)
        before = _AXIS.fullmatch(found[-1]) if found else None
        if bare and before:
            name = f"{before[1]}{bare[1]}{before[3]}"
        found.append(name)
    return found


def _with_numbered_axes(row: Sequence[str]) -> list[str]:
    """Names of which a sensor's alone is followed by 1 and 2, as GoPro's are exported.

    The axes are called in their order; both sensors of a device have the same.
    """
    found = [*row]
    for i, name in enumerate(row[:-2]):
        split = _SENSOR_AND_UNIT.fullmatch(name)
        if [*row[i + 1 : i + 3]] == ["1", "2"] and split is not None:
            found[i : i + 3] = [f"{split[1]} {axis}{split[2] or ''}" for axis in "xyz"]
    return found


def find_stated_rate(
    lines: Sequence[str], separator: str | None
) -> tuple[float, str] | None:
    """Rate in Hz that a line above the numbers states, and that line."""
    for line in lines[: first_numbers(lines, separator)]:
        within = _RATE_WITHIN.findall(line)
        matched = _RATE.fullmatch(line.strip())
        said = [matched.group(1)] if matched else within if len(within) == 1 else []
        if said and float(said[0]) > 0:
            return float(said[0]), line.strip()
    for line in lines[:LATEST]:
        # one with its number for each column looks like a row
        if (step := _STEP.fullmatch(line.strip())) is not None:
            unit = (step[1] or step[3] or "").lower()
            seconds = float(step[2].replace(",", ".")) * _SECONDS[unit]
            if seconds > 0:
                return 1 / seconds, line.strip()
    return None


def parse_numbers(lines: Sequence[str], separator: str | None) -> Array:
    """Numbers of lines, (n, k) as wide as the first; nan where a cell is none."""
    first = first_numbers(lines[:1000], separator)
    if first >= len(lines):
        return np.empty((0, 0))
    parted = separator or find_separator(lines[first])
    width = len(split_cells(lines[first], parted))
    rows = []
    for line in lines[first:]:
        row = line.split(parted)
        if len(row) == width:
            text = [with_points(c) for c in row] if parted != "," else row
            rows.append([_number(cell) for cell in text])
    return np.array(rows, dtype=float).reshape(-1, width)


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return float("nan")
