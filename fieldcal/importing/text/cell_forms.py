"""Cells that are no numbers as they stand: between bars, lists, hexadecimal counts."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Self

from fieldcal.importing.text.text_form import Reader, TextForm, is_true_of_most
from fieldcal.importing.text.text_top import find_separator, is_number, split_cells
from fieldcal.importing.words.sensor_words import AXES

_RULE = re.compile(r"[\s|:+-]*")
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_LIST = re.compile(rf"[\[({{<]\s*({_NUMBER}(?:[\s,;]+{_NUMBER})*)\s*[\])}}>]")
_DIGITS = re.compile(r"(?:0[xX])?([0-9A-Fa-f]{2}|[0-9A-Fa-f]{4}|[0-9A-Fa-f]{8})")

WHOLE = 8
"""Digits of a number of 32 bits."""

MIN_COUNT_COLUMNS = 3
"""Columns of digits that are counts: the axes of a sensor."""


class BarTable(TextForm):
    """Columns between bars, ``| 0.01 | 0.1 |``, also with a rule below the names."""

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if most lines have it."""

        def is_so(line: str) -> bool:
            return line.count("|") > 1 and find_separator(line) in (None, ",")

        return None if separator or not is_true_of_most(lines, is_so) else cls()

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""

        def one(line: str) -> str:
            parted = line.strip().removeprefix("|").removesuffix("|").split("|")
            return "\t".join(cell.strip() for cell in parted)

        return lambda lines: [one(line) for line in lines if not _RULE.fullmatch(line)]


class ListCells(TextForm):
    """Cells that hold a list of numbers each, ``[0.1, 0.2, 9.8]``: columns of it."""

    def __init__(self, separator: str, names: Sequence[str]) -> None:
        self._separator, self.names = separator, tuple(names)

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if most lines have such cells and each as many numbers."""
        if not lines or not is_true_of_most(
            lines, lambda line: bool(_LIST.search(line))
        ):
            return None
        bare = _LIST.sub("0", lines[-1])
        parted = separator or find_separator(bare) or ("\t" if " " not in bare else " ")
        if parted == " " and not all(is_number(cell, False) for cell in bare.split()):
            return None
        many = [len(re.split(r"[\s,;]+", said)) if (said := _list_in(cell)) else 1
                for cell in _cells(lines[-1], parted)]  # fmt: skip
        above = [split_cells(line, parted) for line in lines if not _LIST.search(line)]
        fits = [row for row in above if len(row) == len(many)]
        return cls(parted, _names(fits[-1], many) if fits else ())

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""

        def one(line: str) -> str:
            return self._separator.join(
                self._separator.join(re.split(r"[\s,;]+", said))
                if (said := _list_in(cell)) else cell
                for cell in _cells(line, self._separator)
            )  # fmt: skip

        return lambda lines: [one(line) for line in lines if _LIST.search(line)]


def _list_in(cell: str) -> str:
    """Numbers of a cell that is a list; nothing of another."""
    said = _LIST.fullmatch(cell.strip().strip('"').strip())
    return said[1].strip() if said else ""


def _cells(line: str, separator: str) -> list[str]:
    """Cells of a line; a separator within a list parts none."""
    lists = list(_LIST.finditer(line))
    for said in lists:
        within = said[0].replace(separator, "\0")
        line = f"{line[: said.start()]}{within}{line[said.end() :]}"
    return [cell.replace("\0", separator) for cell in line.split(separator)]


def _names(row: Sequence[str], many: Sequence[int]) -> list[str]:
    """Names of columns, those of a list of three with axes."""
    found: list[str] = []
    for name, n in zip(row, many, strict=True):
        ends = [""] if n == 1 else AXES if n == len(AXES) else map(str, range(n))
        found += [f"{name}_{end}" if end else name for end in ends]
    return found


class HexCells(TextForm):
    """Counts in hexadecimal digits, of as many bits as there are digits, signed.

    Of a column in which negative ones have all 32 bits, the shorter ones are positive,
    as C writes ``%04X``.
    """

    says = "its counts are in hexadecimal digits, taken as signed"

    def __init__(self, separator: str | None, columns: Mapping[int, int]) -> None:
        self._separator, self._columns = separator, dict(columns)

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if some columns hold such digits in most lines, as many in each."""
        if not lines:
            return None
        parted = separator or find_separator(lines[-1])
        rows = [split_cells(line, parted) for line in lines]
        width = len(rows[-1])
        rows = [row for row in rows if len(row) == width]
        cells = [[row[i] for row in rows] for i in range(width)]
        found = {i: _digits_in(column) for i, column in enumerate(cells)}
        sure = [i for i, digits in found.items() if digits]
        if len(sure) < MIN_COUNT_COLUMNS:
            return None
        usual = {len(cell) for i in sure for cell in cells[i]}
        for i in {*found} - {*sure}:
            # of an axis at rest all digits may be decimal ones
            digits = _digits_in(cells[i], filled=True)
            found[i] = digits if digits in usual else 0
        return cls(parted, {i: digits for i, digits in found.items() if digits})

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""

        def one(line: str) -> str:
            row = line.split(self._separator)
            for i, digits in self._columns.items():
                if i < len(row) and (said := _DIGITS.fullmatch(row[i].strip())):
                    bits, value = 4 * len(said[1]), int(said[1], 16)
                    signed = len(said[1]) >= digits and value >> (bits - 1)
                    row[i] = str(value - (1 << bits if signed else 0))
            return (self._separator or " ").join(row)

        return lambda lines: [one(line) for line in lines]


def _digits_in(column: Sequence[str], filled: bool = False) -> int:
    """How many hexadecimal digits the cells below a name have that may be negative.

    0 where they hold something else; all digits may be decimal ones only if zeros fill
    them up.
    """
    said = [m[1] for cell in column if (m := _DIGITS.fullmatch(cell))]
    many = {len(one) for one in said}
    whole = [one for one in said if len(one) == WHOLE]
    extended = many == {WHOLE // 2, WHOLE} and all(o[0] in "Ff" for o in whole)
    told = any(not is_number(m, False) for m in said) or (
        filled and any(one[0] == "0" and one.strip("0") for one in said)
    )
    alike = len(many) == 1 or extended
    return max(many) if alike and told and len(said) > len(column) / 2 + 1 else 0


class SpacedCells(TextForm):
    """Cells of which some hold several numbers, between spaces: a column for each.

    So are lines above them that have as many words, ``t<tab>ax ay az<tab>gx gy gz``.
    """

    def __init__(self, separator: str, width: int) -> None:
        self._separator, self._width = separator, width

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if most lines have it."""
        parted = find_separator(lines[-1]) if lines and not separator else separator
        if parted not in ("\t", ";"):
            return None
        if not is_true_of_most(lines, lambda line: _holds_several(line, parted)):
            return None
        widths = [
            len(_words(line, parted)) for line in lines if _holds_several(line, parted)
        ]
        return cls(parted, max(widths, key=widths.count))

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""

        def one(line: str) -> str:
            words = _words(line, self._separator)
            if len(words) == self._width or _holds_several(line, self._separator):
                return self._separator.join(words)
            return line

        return lambda lines: [one(line) for line in lines]


def _holds_several(line: str, separator: str) -> bool:
    """Whether all cells are numbers, and some several.

    >>> [_holds_several(x, ";") for x in ("1;0.1 0,2;3", "1;2;3", "1;a 2;3", "1; 2;3")]
    [True, False, False, False]
    """
    cells = [cell.split() for cell in line.split(separator)]
    several = any(len(cell) > 1 for cell in cells)
    return several and all(is_number(word, True) for cell in cells for word in cell)


def _words(line: str, separator: str) -> list[str]:
    """All words of a line; of an empty cell one without letters.

    >>> _words("1;0.1 0.2;;3", ";")
    ['1', '0.1', '0.2', '', '3']
    """
    return [word for cell in line.split(separator) for word in cell.split() or [""]]
