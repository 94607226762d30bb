"""Workbooks of spreadsheets: .xlsx, .xls and .ods, of which one sheet is read.

It is the sheet with the most rows, read as text with columns: names, units, rate and
times of a clock are found as there.
"""

from __future__ import annotations

from collections.abc import Iterator
from datetime import date, datetime, time, timedelta
from pathlib import Path
from typing import Any

from fieldcal.core.errors import InputError
from fieldcal.importers.csv_like import TextColumns
from fieldcal.importing.files.gzip_stream import PIECE, unpacked_file

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
            some = rows[first : first + LINES]
            lines = ("\t".join(map(_text, row)) for row in some)
            yield ("\n".join(lines) + "\n").encode()

    def _rows(self) -> list[list[Any]]:
        """Rows of the longest sheet.

        Raises
        ------
        InputError
            If it cannot be read, or is empty.

        """
        from python_calamine import CalamineError, CalamineWorkbook

        with unpacked_file(self.path, self.cut_off) as path:
            try:
                book = CalamineWorkbook.from_path(str(path))
                sheets = {n: book.get_sheet_by_name(n) for n in book.sheet_names}
                longest = max(sheets, key=lambda n: sheets[n].height, default="")
                rows: list[list[Any]] = sheets[longest].to_python() if sheets else []
            except (CalamineError, OSError, ValueError) as error:
                raise InputError(
                    f"{self.path}: cannot be read: {error}; save its sheet as .csv"
                ) from error
        if not rows:
            raise InputError(f"{self.path}: its sheets are empty")
        said = f"its sheet {longest!r} is read"
        self.says += [said] if len(sheets) > 1 and said not in self.says else []
        return rows


def _text(value: Any) -> str:
    """Text of a cell: decimal points, times of day, and no separators."""
    if isinstance(value, timedelta):
        return repr(value.total_seconds())
    if isinstance(value, (datetime, time)):
        return value.isoformat(timespec="microseconds")
    if isinstance(value, date):
        return value.isoformat()
    return " ".join(str(value).split())
