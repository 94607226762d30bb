"""Seconds whose fraction lacks its leading zeros: ``12:00:39.26`` is 39.026 s.

Who writes the seconds, a point and the ms, each as a number, gets such times. Read as
they stand they step back within a second, from 39.93 to 39.160; as ms they only grow.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import NamedTuple, Self

from fieldcal.importing.text.text_form import MOSTLY, Reader, TextForm
from fieldcal.importing.text.text_top import find_separator, split_cells
from fieldcal.importing.times.clock_text import is_clock
from fieldcal.importing.units.scales import MIN_ROWS

COUNTED = (3, 6)
"""Digits of a fraction that counts ms or us."""

_TIME = re.compile(r"(.*?\d)([.,:])(\d{1,6})(\s*(?:Z|UTC|GMT|[+-]\d\d:?\d\d)?)")


class BareSeconds(NamedTuple):
    """A time in two numbers.

    Attributes
    ----------
    whole : up to the seconds
    point, fraction, zone : what stands behind them

    """

    whole: str
    point: str
    fraction: str
    zone: str

    def filled(self, width: int) -> str:
        """The time with all digits of its fraction."""
        return f"{self.whole}{self.point}{self.fraction.zfill(width)}{self.zone}"


class BareFractions(TextForm):
    """Columns with times whose fraction is a number of its own.

    Parameters
    ----------
    separator : of columns
    widths : digits of a whole fraction, by column
    example : such a time

    """

    def __init__(
        self, separator: str | None, widths: dict[int, int], example: BareSeconds
    ) -> None:
        self._separator, self._widths = separator, widths
        whole = example.filled(next(iter(widths.values())))
        self.says = (
            "the fractions of its seconds lack their leading zeros:"
            f" {''.join(example)} is taken as {whole}"
        )

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if times step back as they stand, and never with all digits."""
        if len(lines) < MIN_ROWS:
            return None
        parted = separator or find_separator(lines[-1])
        rows = [split_cells(line, parted) for line in lines]
        widths, example = {}, None
        for i in range(len(rows[-1])):
            times = _times([row[i] for row in rows if i < len(row)])
            width = max((len(one.fraction) for one in times), default=0)
            if len(times) <= MOSTLY * len(rows) or not _are_bare(times, width):
                continue
            widths[i] = width
            example = example or next(o for o in times if len(o.fraction) < width)
        return cls(parted, widths, example) if example else None

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""

        def one(line: str) -> str:
            row = line.split(self._separator)
            for i, width in self._widths.items():
                if i < len(row) and (said := _bare_seconds(row[i].strip())):
                    row[i] = said.filled(width)
            return (self._separator or " ").join(row)

        return lambda lines: [one(line) for line in lines]


def _bare_seconds(cell: str) -> BareSeconds | None:
    """A time of a clock or in seconds, with a fraction; None of another cell."""
    said = _TIME.fullmatch(cell)
    if said is None:
        return None
    number = said[1].isdecimal() and said[2] != ":"
    return BareSeconds(*said.groups()) if number or is_clock(said[1]) else None


def _times(cells: Sequence[str]) -> list[BareSeconds]:
    """Times in a column; none where a fraction has its leading zeros."""
    times = []
    for cell in cells:
        if (one := _bare_seconds(cell)) is None:
            continue
        if one.fraction[0] == "0" != one.fraction:
            return []
        times.append(one)
    return times


def _are_bare(times: Sequence[BareSeconds], width: int) -> bool:
    """Whether the fractions of these times count ms or us, `width` digits at most."""
    if width not in COUNTED:
        return False
    back = 0
    for second in _seconds(times):
        counts = [int(f) for f in second]
        if any(b < a for a, b in zip(counts, counts[1:], strict=False)):
            return False
        decimals = [float(f"0.{f}") for f in second]
        back += any(b < a for a, b in zip(decimals, decimals[1:], strict=False))
    return back > 0


def _seconds(times: Sequence[BareSeconds]) -> Iterator[list[str]]:
    """Fractions of each second, in their order."""
    for _, within in groupby(times, key=lambda one: one.whole):
        yield [one.fraction for one in within]
