"""Values with their labels in a line, as programs print them for people.

    ax: 0.12 ay: 0.34 az: 9.81        AcX = 12 | AcY = 34 | AcZ = 16384
    Acceleration X: 0.1, Y: 0.2, Z: 9.8 m/s^2
    12:34:56.789 -> Accel: 0.1, 0.2, 9.8 g  Gyro: 1, 2, 3
    I (312) IMU: ax=0.1 ay=0.2         2024-05-03 14:20:01,123 INFO acc=(0.1, 0.2, 9.8)
    Accel: x= 0.1 | y= 0.2 | z= 9.8    Acc (mg) [ 10.1, -2.3, 999.1 ], Tmp (C) [ 25.1 ]
    Acceleration in g's  X: 0.1  Y: 0.2  Z: 0.9      ax 0.1 ay 0.2 az 9.8
    accel: {'x': 0.1, 'y': 0.2, 'z': 9.8}            accel: {x: 0.1, y: 0.2, z: 9.8}

An axis alone belongs to the label before it, which may stand without a value; three
values behind one label are axes; a unit holds for all axes before it. A time of day at
the beginning was written by the serial monitor.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache

from fieldcal.importing.text.label_spellings import (
    MAX_UNIT_LETTERS,
    name_temperature,
    plain_labels,
)
from fieldcal.importing.text.log_prefixes import STAMP, TICKS, TIME, log_prefix
from fieldcal.importing.text.repeated_lines import NUMBER
from fieldcal.importing.words.heading_units import parse_unit
from fieldcal.importing.words.heading_words import heading_meaning
from fieldcal.importing.words.sensor_words import AXES

CLOCKS = frozenset((TIME, TICKS, STAMP))
"""Names that each line of a row may have."""

LONGEST = 2000
"""Characters of a line of values for people; a dump of bytes in one line has more."""

LINES = 1 << 12
"""Lines whose values are remembered: the first are read once for each form of a text,
and again for its names, its units and its rows."""

SHAPES = 256
"""Kinds of lines whose names are remembered: a program prints a few."""

_SENSOR = re.compile(r"(.*?:?)[^\w(]*\b([A-Za-z_][\w ()./-]*?)\s*[:=]\s*", re.DOTALL)
"""What stands before an axis: something else, and the label of all its axes."""

_IN_UNIT = re.compile(r"(.+?)(?: in ([^ ]+)| ?[(\[]([^()\[\]]+)[)\]])( [xyzXYZ])?")
"""A label that says the unit of its values."""

_LABEL = re.compile(r"(?<![\w./^²°])([A-Za-z_][^:=,;|\n]*?)\s*[:=]\s*(?=[-+.\d])")
_VALUES = re.compile(rf"\s*({NUMBER}(?:[\s,;|]+{NUMBER})*)\s*(.*)", re.DOTALL)
_STEM = re.compile(r"(.*[^\s_])[\s_]*[xyzXYZ]")
"""A label that ends with an axis, and what the other axes have before it."""

_TICKS = re.compile(
    r"[EWIDV] \((\d+)\) [\w.-]+:\s*|\[\s*(\d+)\]\[[EWIDV]\]\[[^\]]*\]\s*\w+\(\):\s*"
)
"""What ESP-IDF and Arduino write before a line: ms since the start, level and place."""

_COLOURS = re.compile(r"\x1b\[[\d;]*m")
"""Colours of a terminal."""

_PLOTTED = re.compile(rf">([^:|]+):(\d{{10,}}(?:\.\d+)?):({NUMBER})(?:\|\w*)?")
"""A name, ms since 1970 and a value, as Teleplot reads them."""

LEVEL = re.compile(
    r"[\[(|\s-]*(?:DEBUG|INFO|WARNING|WARN|ERROR|TRACE)\b[\])|\s:,-]*"
    r"|\s*[\[(](?i:debug|info|warning|warn|error|trace)[\])][\s:,-]*"
    r"|\s*(?:debug|info|warning|warn|error|trace)(?:\([\w.]*\))?:\s+(?=[A-Za-z])"
    r"|\s*[EWIDV]/[\w.-]+:\s+(?=[A-Za-z])"
)
"""What programs write behind the time of a line."""

ARRIVAL = re.compile(
    r"\s*\[?(\S*\s?\d+:\d\d:\d\d[.,]?\d*|"
    r"\d{4}-\d\d-\d\d[-_T ]\d\d-\d\d-\d\d(?:\.\d+)?)\]?\s*(?:->|>|:+|,|\s)\s*"
)

_NAME = re.compile(r"\W*([A-Za-z][\w-]*(?: #?\d+)?):(?!\S)\W*")
"""What stands alone before the first label: a chip, a program, a sensor or a device."""

_LETTER = re.compile("[A-Za-z_:]")
"""What a line with labels has, and one of numbers alone has not."""

_OF_ALL = {"", "xyz", "value", "values", "data", "axes"}
"""Words before an axis that say that others follow."""

Labelled = tuple[str, str]
"""A label and its value."""

NamedUnit = tuple[str, str]
"""The name of a value and its unit."""


def labelled_values(line: str) -> list[Labelled]:
    """Labels and values of a line, whatever it is called; empty if it has none.

    >>> labelled_values("Acceleration X: -0.1, Y: 0.2 m/s^2")
    [('Acceleration X [m/s^2]', '-0.1'), ('Acceleration Y [m/s^2]', '0.2')]
    >>> labelled_values(">ax:1778789865000:0.1")
    [('time [ms]', '1778789865000'), ('ax', '0.1')]
    >>> labelled_values("1.0, 2.0, 3.0"), labelled_values("a/g: 1 2 3 4 5 6")
    ([], [])
    """
    return [*named_values(line)[1]]


def named_values(line: str) -> tuple[str, tuple[Labelled, ...]]:
    """What stands alone before the labels of a line, and what they label.

    >>> named_values("A: t: 1 x: 2 y: 3")
    ('A', (('t', '1'), ('x', '2'), ('y', '3')))
    """
    if len(line) > LONGEST or not _LETTER.search(line):
        return "", ()
    return _read(line)


@lru_cache(LINES)
def _read(line: str) -> tuple[str, tuple[Labelled, ...]]:
    """The same of a line that may have labels."""
    if plotted := _PLOTTED.fullmatch(line.strip()):
        return "", ((TICKS, plotted[2]), (plotted[1].strip(), plotted[3]))
    line = _COLOURS.sub("", line)
    prefix = log_prefix(line)
    line = line[prefix.length :] if prefix else line
    line = plain_labels(line)
    arrival, ticks = ARRIVAL.match(line), _TICKS.match(line)
    rest = line[arrival.end() :] if arrival else line
    rest = rest[ticks.end() :] if ticks else rest
    rest = LEVEL.sub("", rest, 1) if LEVEL.match(rest) else rest
    name, split = _split_labels(name_temperature(rest))
    parts, values = [], []
    for label, text in split:
        said = _VALUES.fullmatch(text)
        behind = re.findall(NUMBER, said[1]) if said else []
        if said is None or len(behind) not in (1, len(AXES)):
            return "", ()
        values += behind
        parts.append((label, len(behind), said[2].strip(" \t,;|")))
    names = _names(tuple(parts))
    if names is None:
        return "", ()
    read = [*zip(names, values, strict=True)]
    first = [(TIME, arrival[1].strip())] if read and arrival else []
    first += [(TICKS, ticks[1] or ticks[2])] if read and ticks else []
    first += [(prefix.name, prefix.value)] if read and prefix else []
    return name, (*first, *read)


@lru_cache(SHAPES)
def _names(parts: tuple[tuple[str, int, str], ...]) -> tuple[str, ...] | None:
    """Names of the values of a line, with their units; None if it is a sentence.

    They are the same in all lines that a program prints in the same way.

    Parameters
    ----------
    parts : of each label its text, how many values follow, and what stands behind them

    """
    read: list[NamedUnit] = []
    for label, many, behind in parts:
        label, moved = _split_unit(label, read)
        if moved and read:
            read = _with_unit(read, moved)
        label, unit = complete_label(label, read)
        names = [f"{label} {a}" for a in AXES] if many > 1 else [label]
        read += [(name, unit) for name in names]
        if len(behind) > MAX_UNIT_LETTERS:
            return None
        if parse_unit(behind):
            read = _with_unit(read, behind)
    return tuple(f"{name} [{unit}]" if unit else name for name, unit in read)


def _split_labels(line: str) -> tuple[str, list[tuple[str, str]]]:
    """What a line is called, and its labels with what stands behind each.

    There are none if anything else stands before the first.

    >>> _split_labels("Accel: x= 1 | y= 2 Gyro: x= 3")
    ('', [('Accel x', '1 | '), ('y', '2'), ('Gyro x', '3')])
    """
    parts = _LABEL.split(line)
    if len(parts) < len(AXES):
        return "", []
    labels, texts = [_bare_label(one) for one in parts[1::2]], parts[::2]
    for i, label in enumerate(labels):
        sensor = _SENSOR.fullmatch(texts[i])
        if sensor and label.lower() in AXES:
            texts[i], labels[i] = sensor[1], f"{sensor[2]} {label}"
    if len({*labels}) < len(labels):
        labels = [*_told_apart(tuple(labels))]
    if any(map(str.isalnum, _NAME.sub("", texts[0], 1))):
        return "", []
    alone = _NAME.search(texts[0])
    name, labels[0] = (alone[1], labels[0]) if alone else _of_line(tuple(labels))
    return name, [*zip(labels, texts[1:], strict=True)]


@lru_cache(SHAPES)
def _told_apart(labels: tuple[str, ...]) -> tuple[str, ...]:
    """Labels of which some are the same, with the words before the last such one.

    >>> _told_apart(("left ax", "ay", "right ax", "ay"))
    ('left ax', 'left ay', 'right ax', 'right ay')
    """
    found, before = [], ""
    for label in labels:
        words, _, axis = label.rpartition(" ")
        said = heading_meaning(axis)
        mine = said is not None and bool(said.axis)
        before = words if mine and words else before
        found.append(f"{before} {axis}" if mine and before else label)
    return tuple(found)


@lru_cache(SHAPES)
def _of_line(labels: tuple[str, ...]) -> tuple[str, str]:
    """What a line is called before its first label, and that label.

    >>> _of_line(("left ax", "ay", "az")), _of_line(("Accel x", "y", "z"))
    (('left', 'ax'), ('', 'Accel x'))
    """
    before, _, label = labels[0].rpartition(" ")
    whole, said = heading_meaning(labels[0]), heading_meaning(label)
    if (
        (said is None or not said.axis)
        # of other than measured accelerations it says what they are
        or (whole is None or whole.weak or whole.kind != said.kind)
        or any(" " in one for one in labels[1:])
    ):
        return "", labels[0]
    return before.strip(" ->[](){}#:|"), label


def _bare_label(label: str) -> str:
    """A label with single spaces; of one that names all axes and one, the one.

    >>> _bare_label("XYZ values - X"), _bare_label("Accel  X")
    ('X', 'Accel X')
    """
    words = label.split()
    others = {word.strip("-:").lower() for word in words[:-1]}
    return words[-1] if "xyz" in others and others <= _OF_ALL else " ".join(words)


def _split_unit(label: str, read: Sequence[NamedUnit]) -> tuple[str, str]:
    """A label, and the unit of the value before it that stands before it.

    In ``A Z: 3 G X: 4 G Y: 5`` the G is no unit: A X has been read, and G is what the
    axis before begins with.
    """
    first, _, rest = label.partition(" ")
    rest = rest.strip()
    if not rest or not parse_unit(first):
        return label, ""
    names = [name for name, _ in read]
    own = rest.lower() in AXES and (
        complete_label(rest, read)[0] in names
        or (bool(names) and names[-1].rpartition(" ")[0] == first)
    )
    return (label, "") if own else (rest, first)


def complete_label(label: str, read: Sequence[NamedUnit]) -> tuple[str, str]:
    """A label and its unit; of an axis alone with what the one before it says."""
    before, unit = read[-1] if read else ("", "")
    bare, _, axis = before.rpartition(" ")
    if bare and label.lower() in AXES and axis.lower() in AXES:
        return f"{bare} {label}", unit
    said = _IN_UNIT.fullmatch(label)
    if said and parse_unit(said[2] or said[3]):
        return said[1] + (said[4] or ""), said[2] or said[3]
    return label, ""


def _with_unit(read: Sequence[NamedUnit], unit: str) -> list[NamedUnit]:
    """Values with the unit behind the last one, which applies to all axes."""
    last = read[-1][0]
    stem = _STEM.fullmatch(last)

    def mine(name: str) -> bool:
        other = _STEM.fullmatch(name)
        return name == last or bool(stem and other and other[1] == stem[1])

    return [(n, u or (unit if mine(n) else "")) for n, u in read]
