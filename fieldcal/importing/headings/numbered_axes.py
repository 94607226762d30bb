"""Axes that are numbered: ``accel_0 accel_1 accel_2``, ``dv[1] dv[2] dv[3]``.

Or listed in the first of three names: ``accel (z,x,y)``, ``1``, ``2``.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from fieldcal.importing.headings.heading import Column
from fieldcal.importing.words.heading_words import heading_meaning
from fieldcal.importing.words.listed_axes import names_of_listed_axes
from fieldcal.importing.words.sensor_words import AXES

_NUMBERED = re.compile(r"(.*\D)[\[(]?([0-3])[\])]?(\s*[\[(][^\d\[\]()]+[\])])?")
"""A name that ends with a number, and maybe a unit."""

_QUATERNION = re.compile(r"(.*[^\W_])[_ .]q([0-3])")
"""A component of a quaternion by its number: ``OriInc_q1``."""

BEGINS = (0, 1)
"""Number of the first axis."""


def with_lettered_axes(columns: Sequence[Column]) -> list[Column]:
    """Columns of which three that are numbered side by side are called x, y and z.

    >>> three = [Column("", f"Accel{i} [g]") for i in range(3)]
    >>> [column.name for column in with_lettered_axes(three)]
    ['Accel_x [g]', 'Accel_y [g]', 'Accel_z [g]']
    """
    found = _with_listed_axes(_with_lettered_turns(columns))
    numbered = [_NUMBERED.fullmatch(column.name.strip()) for column in found]
    for i in range(len(columns) - 2):
        three = numbered[i : i + 3]
        if not all(three) or _follows(numbered, i - 1) or _follows(numbered, i + 2):
            continue
        said = [(one[1], one[3], int(one[2])) for one in three if one is not None]
        same = {(stem, unit) for stem, unit, _ in said}
        begin = said[0][2]
        counted = [number - begin for _, _, number in said] == [0, 1, 2]
        stem = said[0][0].rstrip("[(_ ")
        if len(same) > 1 or not counted or begin not in BEGINS or not _is_sensor(stem):
            continue
        for k, axis in enumerate(AXES):
            name = f"{stem}_{axis}{said[k][1] or ''}"
            found[i + k] = found[i + k]._replace(name=name)
    return found


def _with_listed_axes(columns: Sequence[Column]) -> list[Column]:
    """Columns of which three stand below one name that lists their axes.

    The names of the other two are numbers, or nothing.

    >>> three = [Column("", name) for name in ("Gyro (z,x,y) [rad/s]", "1", "2")]
    >>> [column.name for column in _with_listed_axes(three)]
    ['Gyro z [rad/s]', 'Gyro x [rad/s]', 'Gyro y [rad/s]']
    """
    found = [*columns]
    for i, column in enumerate(columns):
        names = names_of_listed_axes(column.name)
        others = [one.name.strip() for one in columns[i + 1 : i + len(AXES)]]
        bare = all(not one or one.isdecimal() for one in others)
        if names and bare and len(others) == len(AXES) - 1:
            for k, name in enumerate(names):
                found[i + k] = columns[i + k]._replace(name=name)
    return found


def _with_lettered_turns(columns: Sequence[Column]) -> list[Column]:
    """Columns of which the last three of the quaternion of a turn are x, y and z.

    >>> four = [Column("", f"OriInc_q{i}") for i in range(4)]
    >>> [column.name for column in _with_lettered_turns(four)]
    ['OriInc_w', 'OriInc_x', 'OriInc_y', 'OriInc_z']
    """
    found = []
    for column in columns:
        numbered = _QUATERNION.fullmatch(column.name.strip())
        said = numbered and heading_meaning(f"{numbered[1]}_x", column.unit)
        if numbered and said and said.half:
            letter = "wxyz"[int(numbered[2])]
            column = column._replace(name=f"{numbered[1]}_{letter}")
        found.append(column)
    return found


def _follows(numbered: Sequence[re.Match[str] | None], i: int) -> bool:
    """Whether a column and the one behind it are numbers of one array."""
    both = numbered[i : i + 2] if i >= 0 else []
    one, other = both if len(both) == 2 else (None, None)
    return one is not None and other is not None and one[1] == other[1]


def _is_sensor(stem: str) -> bool:
    """Whether a name with an axis behind it would be that of a sensor."""
    said = heading_meaning(f"{stem}_x")
    return said is not None and said.kind in ("a", "g") and said.axis == "x"
