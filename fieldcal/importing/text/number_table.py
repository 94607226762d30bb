"""Numbers in the columns of a text, a piece at a time.

Arrow reads what is plain; lines that it does not understand are read again one by one,
so that each that is none can be named.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.importing.columns import SKIP
from fieldcal.importing.text.text_lines import (
    COMMENTS,
    MISSING,
    plain_numbers,
    split_lines,
)
from fieldcal.importing.text.text_top import with_points


class NumberTable:
    """Reads the wanted columns of lines.

    Parameters
    ----------
    names : of all columns, `SKIP` for those that are not wanted
    separator : of columns, None for spaces
    place : names a row, counted from 0
    damaged : takes a place and what is wrong there

    Attributes
    ----------
    seen : rows that were read
    headings : lines of words between them, which are no rows

    """

    def __init__(
        self,
        names: Sequence[str],
        separator: str | None,
        place: Callable[[int], str],
        damaged: Callable[[str, str], None],
    ) -> None:
        self._names, self._separator = names, separator
        self._place, self._damaged = place, damaged
        self._use = [i for i, name in enumerate(names) if name != SKIP]
        self.seen = self.headings = 0

    def read(self, data: bytes) -> Sequence[Array]:
        """Numbers of the wanted columns of some lines, (n,) each."""
        found = plain_numbers(data, len(self._names), self._use, self._separator)
        if found is None:
            found = self._by_lines(split_lines(data))
        self.seen += len(found[0])
        return found

    def _by_lines(self, lines: list[str]) -> list[Array]:
        use, separator = self._use, self._separator
        how: dict[str, Any] = {"delimiter": separator, "ndmin": 2, "comments": None}
        if len(use) < len(self._names):
            how["usecols"] = use
        if separator != ",":
            lines = [with_points(line) for line in lines]
        try:
            # of no lines, numpy warns
            table = list(np.loadtxt(lines, **how).T) if lines else []
        except ValueError:
            table = []
        if len(table) != len(use):
            rows = [self._row(n, line) for n, line in enumerate(lines, self.seen)]
            whole = [row for row in rows if row]
            table = list(np.array(whole, dtype=float).reshape(-1, len(use)).T)
        return table

    def _row(self, number: int, line: str) -> list[float]:
        """Numbers of one line, the slow way; nothing of one that is left out."""
        cells = line.split(self._separator)
        if _are_names(cells) or (len(cells) != len(self._names) and _is_said(line)):
            self.headings += 1
            return []
        if len(cells) != len(self._names):
            what = f"has {len(cells)} columns, not {len(self._names)}"
            self._damaged(self._place(number), what)
            return []
        row = []
        for name, cell in zip(self._names, cells, strict=True):
            if name == SKIP:
                continue
            try:
                bare = cell.strip()
                row.append(float("nan" if bare in MISSING else bare))
            except ValueError:
                what = f"{cell.strip()[:20]!r} is not a number"
                self._damaged(f"{self._place(number)}, column {name}", what)
                return []
        return row


def _is_said(line: str) -> bool:
    """Whether a line is a sentence, as a device says while it starts.

    What is left of a row whose bytes were lost is figures and signs, and a word for a
    number that is missing is one of a row.

    >>> [_is_said(x) for x in ("MPU6050 connected, 2 retries", "0.12,-3e", "X: nan")]
    [True, False, False]
    >>> _is_said("// mark 12345")
    True
    """
    if line.lstrip().startswith(COMMENTS):
        return line.isprintable()
    words = re.findall(r"[^\W\d_]+", line)
    letters = sum(len(w) for w in words if len(w) > 1)
    row = bool({*words} & {*MISSING})
    return line.isprintable() and not row and letters > sum(map(str.isdigit, line))


def _are_names(cells: Sequence[str]) -> bool:
    """Whether cells are all words, as a device writes them when it starts."""
    said = [cell.strip().strip('"').strip() for cell in cells]
    words = all(not cell or cell[:1].isalpha() for cell in said)
    return words and len({*said} - {*MISSING}) > 1
