"""Columns that may be the time or the three axes of a sensor, where no name says it.

Time only grows. Axes vary, stand side by side or are named alike, and are no attitude.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.importing.units.scales import MIN_ROWS
from fieldcal.importing.words.heading_words import (
    heading_meaning,
    words_in_name,
)
from fieldcal.importing.words.other_columns import is_counter, is_other_quantity
from fieldcal.importing.words.sensor_words import AXES

GROWS = 0.999
"""Share of steps of a time that are positive: a line may be damaged."""

RATES = ("p", "q", "r")
"""What those who fly call rates about x, y and z."""

UNIT_LENGTH = 0.02
"""Part by which the length of a quaternion of two decimals may differ from 1."""

Three = tuple[int, int, int]


class FreeColumns(NamedTuple):
    """What columns may be.

    Attributes
    ----------
    channels : that are known, with the time
    clock : (n,) of the rows, which counts them where no column is a time
    forces, rates : sets of three columns that may be the axes of either
    named : those that are known

    """

    channels: Mapping[int, str]
    clock: Array
    forces: Sequence[Three]
    rates: Sequence[Three]
    named: Sequence[Three]


def free_columns(
    table: Array, names: Sequence[str], known: Mapping[int, str]
) -> FreeColumns:
    """The time of a table (n, k), and sets of its columns that may be axes."""
    channels = dict(known)
    times = [i for i in _growing(table) if i not in known]
    times = [i for i in times if not is_other_quantity(names[i])]
    if "t" not in channels.values():
        clocks = [
            i for i in times if not (_counts(table[:, i]) or is_counter(names[i]))
        ]
        if clocks:
            # a thermometer may only grow as well, but the time stands first
            channels[next((i for i in clocks if _says_time(names[i])), clocks[0])] = "t"
    t = next((i for i, name in channels.items() if name == "t"), None)
    clock: Array = np.arange(len(table), dtype=float) if t is None else table[:, t]
    free = [i for i in range(table.shape[1]) if i not in {*known, *times}]
    acc, gyr = _named(known, "a"), _named(known, "g")
    attitude = _quaternions(table)
    moving = [i for i in free if _moves(table[:, i]) and i not in attitude]
    threes = _axis_triples(moving, names)
    named = [three for three in (acc, gyr) if three]
    return FreeColumns(
        channels, clock, [acc] if acc else threes, [gyr] if gyr else threes, named
    )


def channels_of(kind: str, three: Three) -> dict[int, str]:
    """Channels of the axes of a sensor by column."""
    return {i: kind + axis for i, axis in zip(three, AXES, strict=True)}


def unnamed_axes(
    table: Array, names: Sequence[str], known: Collection[int]
) -> list[Three]:
    """Columns without known meaning that vary and may be three axes.

    An axis may rest within one step of its output, if its name says that it is one.
    """
    if len(table) < MIN_ROWS or table.shape[1] != len(names):
        return []
    without = {*known, *_growing(table), *_quaternions(table)}
    free = [i for i in range(table.shape[1]) if i not in without]
    moving = [i for i in free if _moves(table[:, i])]
    named = [three for three in _by_name(free, names) if {*three} & {*moving}]
    return _axis_triples(moving, names) or named


def _says_time(name: str) -> bool:
    """Whether a column is called a time."""
    said = heading_meaning(name)
    return said is not None and said.kind == "t"


def _growing(table: Array) -> list[int]:
    """Columns that only grow."""
    found = []
    for i in range(table.shape[1]):
        column = table[:, i]
        steps = np.diff(column[np.isfinite(column)])
        if len(steps) > len(table) / 2 and (steps > 0).mean() >= GROWS:
            found.append(i)
    return found


def _counts(column: Array) -> bool:
    """Whether a column counts rows."""
    steps = np.diff(column[np.isfinite(column)])
    return bool((steps == 1).mean() > GROWS)


def _quaternions(table: Array) -> set[int]:
    """Columns that are an attitude: of four side by side the length is always 1.

    That of an accelerometer in g beside a calm gyroscope is that of three of them.
    """
    found: set[int] = set()
    for i in range(table.shape[1] - 3):
        four = table[:, i : i + 4]
        four = four[np.isfinite(four).all(axis=1)]
        threes = (four[:, :3], four[:, 1:])
        if _has_unit_length(four) and not any(map(_has_unit_length, threes)):
            found |= {*range(i, i + 4)}
    return found


def _has_unit_length(values: Array) -> bool:
    off = np.abs(np.linalg.norm(values, axis=1) - 1)
    return bool(len(off) and off.max() < UNIT_LENGTH)


def _moves(column: Array) -> bool:
    known = column[np.isfinite(column)]
    return len(known) > len(column) / 2 and float(np.ptp(known)) > 0


def _named(known: Mapping[int, str], kind: str) -> Three | None:
    where = {name: i for i, name in known.items()}
    if not all(kind + axis in where for axis in AXES):
        return None
    x, y, z = (where[kind + axis] for axis in AXES)
    return x, y, z


def _axis_triples(free: Sequence[int], names: Sequence[str]) -> list[Three]:
    """Columns that may be three axes, by their names or their order."""
    whole = _by_name(free, names)
    if whole and len({names[i] for i in free}) == len(free):
        return whole
    beside = zip(free, free[1:], free[2:], strict=False)
    side = [_by_letters((a, b, c), names) for a, b, c in beside if c == a + 2]
    parted = len(free) % len(AXES) == 0 and len(side) == len(free) - len(AXES) + 1
    return side[:: len(AXES)] if parted else side


def _by_letters(three: Three, names: Sequence[str]) -> Three:
    """Columns side by side in the order of the axes that their names end with."""
    ends = [words_in_name(names[i])[-1:] for i in three]
    letters = {end[0]: i for i, end in zip(three, ends, strict=True) if end}
    if {*letters} != {*AXES}:
        return three
    x, y, z = (letters[axis] for axis in AXES)
    return x, y, z


def _by_name(free: Sequence[int], names: Sequence[str]) -> list[Three]:
    """Columns that are three axes, by the words that their names share."""
    found: list[Three] = []
    for letters in (AXES, RATES):
        stems: dict[str, dict[str, int]] = {}
        form = re.compile(rf"(.*?)[_ .]?([{''.join(letters)}])(\W.*|)")
        for i in free:
            if matched := form.fullmatch(names[i].lower()):
                stem = f"{matched.group(1)}|{matched.group(3)}"
                stems.setdefault(stem, {})[matched.group(2)] = i
        x, y, z = letters
        found += [(s[x], s[y], s[z]) for s in stems.values() if len(s) == len(letters)]
    return found
