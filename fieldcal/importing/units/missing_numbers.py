"""Numbers that stand for no value, such as -999.

Loggers that must write a number where there is none write one that no sensor gives, in
all columns of a sensor. It is told by that: the same number in all three of them, and
far beyond what they hold otherwise, or in accelerometers and gyroscopes alike.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import CHANNELS, Array

NO_VALUE_RATIO = 2.0
"""Times the largest number that a sensor gives otherwise, from which one is no value:
a sensor that clips clips at once what it never reached in one of its axes alone."""

ORDINARY = 0.5
"""Least share of rows that are as rows are, by which others can be told from them."""

TRIADS = (CHANNELS[:3], CHANNELS[3:])

Rows = NDArray[np.bool_]


class MissingNumbers:
    """Takes numbers that stand for no value out of columns, piece by piece.

    Attributes
    ----------
    rows : how many rows hold nothing else in a sensor, by the number

    """

    def __init__(self) -> None:
        self.rows: dict[float, int] = {}

    @property
    def says(self) -> list[str]:
        """What was taken for no value, a sentence for each number."""
        return [
            f"{number:g} stands for a missing value: {n} rows have nothing else in all"
            " axes of a sensor"
            for number, n in self.rows.items()
        ]

    def without(self, columns: Mapping[str, Array]) -> Mapping[str, Array]:
        """Columns (n,) by name, nan where a number stands for no value.

        Parameters
        ----------
        columns : as the file has them, before any unit

        """
        whole = [some for some in TRIADS if columns.keys() >= {*some}]
        if not whole or not len(columns[whole[0][0]]):
            return columns
        alike = [_alike(columns, some) for some in whole]
        told = set(self.rows)
        for some, same in zip(whole, alike, strict=True):
            told |= _beyond(columns, some, same)
        if len(alike) == len(TRIADS):
            acc, gyr = columns["ax"], columns["gx"]
            both = alike[0] & alike[1] & (acc == gyr)
            told |= set(acc[both].tolist()) if both.mean() <= 1 - ORDINARY else set()
        kept = dict(columns)
        for number in sorted(told):
            gone = [same & (columns[some[0]] == number)
                    for some, same in zip(whole, alike, strict=True)]  # fmt: skip
            for some, rows in zip(whole, gone, strict=True):
                kept |= {c: np.where(rows, np.nan, kept[c]) for c in some if rows.any()}
            n = int(np.any(gone, axis=0).sum())
            self.rows[number] = self.rows.get(number, 0) + n
        return kept


def _alike(columns: Mapping[str, Array], some: tuple[str, ...]) -> Rows:
    """Rows in which a sensor's columns hold one number, other than zero."""
    x, y, z = (columns[c] for c in some)
    found: Rows = (x == y) & (x != 0)
    if found.any():
        found &= y == z
    return found


def _beyond(
    columns: Mapping[str, Array], some: tuple[str, ...], same: Rows
) -> set[float]:
    """Numbers in such rows that are far beyond what is in all others."""
    first = columns[some[0]]
    if not same.any() or same.mean() > 1 - ORDINARY:
        return set()
    others = np.abs([columns[c][~same] for c in some])
    most = np.max(others, initial=0.0, where=np.isfinite(others))
    return (
        set(first[same & (np.abs(first) > NO_VALUE_RATIO * most)].tolist())
        if most
        else set()
    )
