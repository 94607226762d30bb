"""Workbooks with a sheet for each sensor, as programs on telephones export them.

The name of a sheet is the title of its table.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

from fieldcal.core.errors import InputError
from fieldcal.importers.sensor_tables import SensorTables
from fieldcal.importers.workbook import WorkbookSheets, row_text
from fieldcal.importers.workbook import recognises as is_workbook
from fieldcal.importing.words.file_names import SENSOR, sensor_of_file_name

WHAT = "workbooks with a sheet for each sensor"


def recognises(head: bytes, path: Path) -> bool:
    """Whether the sheets of a workbook are called by both sensors, the longest too."""
    if not is_workbook(head, path) or find_spec("python_calamine") is None:
        return False
    try:
        with WorkbookSheets.opened(path) as book:
            called = {name: sensor_of_file_name(name) for name in book.names}
            return {*SENSOR} <= {*called.values()} and bool(called[book.longest()])
    except InputError:
        return False


class SensorSheets(SensorTables):
    """Sheets of sensors, with one IMU in them or several."""

    def needs(self) -> tuple[tuple[str, ...], str]:
        """Return what reads workbooks."""
        return ("python_calamine",), "excel"

    def text_lines(self) -> Iterator[str]:
        """Rows of all sheets, each behind its name."""
        with WorkbookSheets.opened(self.path, self.cut_off) as book:
            for name in book.names:
                yield name
                yield from map(row_text, book.rows(name))
