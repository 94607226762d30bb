"""Names that come again in one heading, told apart: they are of several IMUs.

accX;accY;accZ;gX;gY;gZ;accX;accY;accZ;gX;gY;gZ       by their order
AccX (BMI),AccY (BMI),...,AccX (MPU),AccY (MPU)       by what stands in brackets
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

from fieldcal.importing.headings.heading import Column
from fieldcal.importing.words.heading_units import parse_unit
from fieldcal.importing.words.heading_words import heading_meaning

_BRACKETED = re.compile(r"(.*?)\s*[\[(](?![xyzXYZ][\])])(\w[\w ]*)[\])]\s*")
"""A name with more in brackets than its axis."""


def with_distinct_names(columns: Sequence[Column]) -> list[Column]:
    """Columns of which the names of axes that come again say which of them it is.

    >>> twice = [Column("", name) for name in ("t", "ax", "gx", "ax", "gx")]
    >>> [column.name for column in with_distinct_names(twice)]
    ['t', '1 ax', '1 gx', '2 ax', '2 gx']
    """
    if any(column.place for column in columns):
        return [*columns]  # told apart by their places already
    parted = [_parted(column.name) for column in columns]
    bare = Counter(name for name, _ in parted)
    whole = Counter(column.name for column in columns)
    seen: Counter[str] = Counter()
    found = []
    for column, (name, which) in zip(columns, parted, strict=True):
        seen[column.name] += 1
        if _is_axis(column):
            if whole[column.name] > 1:
                column = column._replace(name=f"{seen[column.name]} {column.name}")
            elif which and bare[name] > 1:
                column = column._replace(name=f"{which} {name}")
        found.append(column)
    return found


def _is_axis(column: Column) -> bool:
    said = heading_meaning(column.name, column.unit)
    return said is not None and said.kind in ("a", "g") and bool(said.axis)


def _parted(name: str) -> tuple[str, str]:
    """A name, and what stands in brackets behind it that is no unit."""
    said = _BRACKETED.fullmatch(name)
    if said is None or parse_unit(said[2]):
        return name, ""
    return said[1], said[2]
