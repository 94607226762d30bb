"""Rows below a line with the time of the first and a line with their rate.

    1700000000.00, 1700000000.00, 1700000000.00
    32.000000, 32.000000, 32.000000
    -53,19,31

Bracelets of Empatica write so, both numbers once a column; what has three columns is
the accelerometer. Source: Empatica, E4 data
export: the first row is the UNIX time of the session, the second the sample rate in Hz.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple, Self

from fieldcal.importing.text.text_form import Reader, TextForm
from fieldcal.importing.units.time_units import RATES_HZ, UNIX

_NUMBER = re.compile(r"\d+(?:\.\d*)?")


class StartAndRate(NamedTuple):
    """Time of the first row, s since 1970, and the rate of all, Hz."""

    time: float
    rate: float


class RateOnTop(TextForm):
    """Three columns whose first lines say when each row was taken."""

    names = ("time [s]", "acc_x", "acc_y", "acc_z")
    gathers = True
    says = "its first line is the time of its first row, its second one their rate"

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if it begins so."""
        return cls() if _beginning(lines[:2]) is not None else None

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""
        top: list[str] = []
        rows = 0

        def read(lines: Sequence[str]) -> list[str]:
            nonlocal rows
            missing = 2 - len(top)
            top.extend(lines[:missing])
            if (began := _beginning(top)) is None:
                return []
            below = lines[max(0, missing) :]
            numbered = list(enumerate(below, rows))
            rows += len(below)
            return [f"{began.time + i / began.rate:.6f},{row}" for i, row in numbered]

        return read


def _beginning(lines: Sequence[str]) -> StartAndRate | None:
    """What two lines say; None if they are other lines.

    >>> _beginning(["1700000000.0, 1700000000.0, 1700000000.0", "32.0, 32.0, 32.0"])
    StartAndRate(time=1700000000.0, rate=32.0)
    """
    cells = [[cell.strip() for cell in line.split(",")] for line in lines]
    if len(cells) != 2 or any(len(row) != 3 or len({*row}) != 1 for row in cells):
        return None
    if not all(_NUMBER.fullmatch(row[0]) for row in cells):
        return None
    began, rate = (float(row[0]) for row in cells)
    usual = UNIX[0] <= began < UNIX[1] and RATES_HZ[0] <= rate <= RATES_HZ[1]
    return StartAndRate(began, rate) if usual else None
