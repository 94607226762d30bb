"""Workbooks of spreadsheets: .xlsx, .xls and .ods, of which one sheet is read.

It is the sheet with the most rows, read as text with columns: names, units, rate and
times of a clock are found as there.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import date, datetime, time, timedelta
from pathlib import Path
from typing import Any, Self

from fieldcal.core.errors import InputError
from fieldcal.importers.csv_like import TextColumns
from fieldcal.importing.files.packed_stream import PIECE, OnTruncation, unpacked_file

WHAT = "workbooks of spreadsheets"

OLD = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
ARCHIVE = b"PK\x03\x04"
MARKS = (
    b"[Content_Types].xml",
    b"xl/",
    b"application/vnd.oasis.opendocument.spreadsheet",
)
"""What stands among the first bytes of an archive that is a workbook."""

LINES = 4096
"""Rows written together."""


def recognises(head: bytes, path: Path) -> bool:
    """Whether a file begins like a workbook."""
    packed = head.startswith(ARCHIVE) and any(mark in head for mark in MARKS)
    return packed or head.startswith(OLD)


class WorkbookSheet(TextColumns):
    """A sheet, with one IMU in it or several side by side."""

    def needs(self) -> tuple[tuple[str, ...], str]:
        """Return what reads workbooks."""
        return ("python_calamine",), "excel"

    def place(self, row: int) -> str:
        """Name a row; empty ones are not counted."""
        return f"row {self._skip + row + 1}"

    def pieces(self, size: int = PIECE) -> Iterator[bytes]:
        """The sheet as text, its cells parted by tabs."""
        rows = self._rows()
        for first in range(0, len(rows), LINES):
            lines = map(row_text, rows[first : first + LINES])
            yield ("\n".join(lines) + "\n").encode()

    def _rows(self) -> list[list[Any]]:
        """Rows of the longest sheet.

        Raises
        ------
        InputError
            If it cannot be read, or is empty.

        """
        with WorkbookSheets.opened(self.path, self.cut_off) as book:
            longest = book.longest()
            rows = book.rows(longest) if book.names else []
            several = len(book.names) > 1
        if not rows:
            raise InputError(f"{self.path}: its sheets are empty")
        said = f"its sheet {longest!r} is read"
        self.says += [said] if several and said not in self.says else []
        return rows


class WorkbookSheets:
    """Sheets of a workbook that is open.

    Parameters
    ----------
    path : of the workbook, for errors
    book : as python_calamine gives it

    Attributes
    ----------
    names : of its sheets

    """

    def __init__(self, path: Path, book: Any) -> None:
        self._path, self._book = path, book
        self.names: list[str] = book.sheet_names

    @classmethod
    @contextmanager
    def opened(cls, path: Path, cut: OnTruncation | None = None) -> Iterator[Self]:
        """Open a workbook.

        Raises
        ------
        InputError
            If it cannot be read.

        """
        from python_calamine import CalamineError, CalamineWorkbook

        with unpacked_file(path, cut) as whole:
            try:
                yield cls(path, CalamineWorkbook.from_path(str(whole)))
            except (CalamineError, OSError, ValueError) as error:
                raise InputError(
                    f"{path}: cannot be read: {error}; save its sheet as .csv"
                ) from error

    def longest(self) -> str:
        """Name of the sheet with the most rows; "" without any."""
        heights = {n: self._book.get_sheet_by_name(n).height for n in self.names}
        return max(heights, key=heights.__getitem__, default="")

    def rows(self, name: str) -> list[list[Any]]:
        """Rows of a sheet."""
        found: list[list[Any]] = self._book.get_sheet_by_name(name).to_python()
        return found


def row_text(row: Sequence[Any]) -> str:
    """Text of a row, its cells parted by tabs."""
    return "\t".join(map(_text, row))


def _text(value: Any) -> str:
    """Text of a cell: decimal points, times of day, and no separators."""
    if isinstance(value, timedelta):
        return repr(value.total_seconds())
    if isinstance(value, (datetime, time)):
        return value.isoformat(timespec="microseconds")
    if isinstance(value, date):
        return value.isoformat()
    return " ".join(str(value).split())
