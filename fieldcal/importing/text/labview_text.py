"""Measurements of LabVIEW as text (.lvm): headers before the columns of each segment.

    LabVIEW Measurement
    Separator   Tab
    ***End_of_Header***
    Channels    6
    Delta_X     0.02    0.02    ...
    ***End_of_Header***
    X_Value     Acc X   Acc Y   ...     Comment
    0.00        0.1     0.2     ...

The headers' numbers are no rows; ``Delta_X`` is the time from row to row, where
``X_Value``, the time, may be empty.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Self

from fieldcal.importing.text.text_form import Reader, TextForm

MARK, SEGMENT, END = "LabVIEW Measurement", "Channels", "***End_of_Header***"
TIME, STEP = "X_Value", "Delta_X"

TOP = 3
"""Lines at the top among which the mark is looked for."""

_CELL = re.compile(r"[\t,;]")


class LabviewText(TextForm):
    """Rows and names of such a text, with the time from row to row above them."""

    gathers = True

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if the text begins with its mark."""
        return cls() if any(line.startswith(MARK) for line in lines[:TOP]) else None

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""
        inside, told = True, set[str]()

        def read(lines: Sequence[str]) -> list[str]:
            nonlocal inside
            found = []
            for line in lines:
                first, *rest = _CELL.split(line, maxsplit=1)
                inside = inside or first in (MARK, SEGMENT)
                if inside:
                    if first == STEP and rest and not told & {STEP}:
                        found.append(f"{STEP}\t{rest[0].split(line[len(STEP)])[0]}")
                        told.add(STEP)
                    inside = first != END
                elif first != TIME:
                    found.append(line)
                elif not told & {TIME}:
                    found.append("time [s]" + line[len(TIME) :])
                    told.add(TIME)
            return found

        return read
