"""Texts with a line for each value: melted data frames, exports of time series.

    time,variable,value                 "Series";"Time";"Value"
    0.00,ax,0.1                         "imu.ax";"2024-05-03T12:00:00.01Z";"0,1"

The lines of one series may stand behind those of another: all are read together.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from fieldcal.importers.arrays import ArrayFile
from fieldcal.importing.arrays.array_groups import arrays_in_group
from fieldcal.importing.arrays.array_tables import ArrayTable, table_of
from fieldcal.importing.files.text_encoding import as_utf8, is_mostly_text
from fieldcal.importing.records.series_rows import (
    SeriesColumns,
    arrays_of,
    read_series,
)
from fieldcal.importing.text.long_tables import LongTable

WHAT = "text with a line for each value"

TIME, CLOCK = "time", "utc time [s]"
"""What times are called that count something, and those that were read of a clock."""


def recognises(head: bytes, path: Path) -> bool:
    """Whether these are the first bytes of one that cannot be read line by line."""
    if not is_mostly_text(head):
        return False
    lines = _lines(head.decode(errors="replace"))[:-1]
    known = SeriesColumns.of(lines) is not None
    return known and LongTable.of(lines, None) is None


class SeriesLog(ArrayFile):
    """Series of values, with one IMU in them or several."""

    def needs(self) -> tuple[tuple[str, ...], str]:
        """Return what reading it takes: nothing."""
        return (), ""

    @contextmanager
    def _whole_arrays(self) -> Iterator[dict[str, ArrayTable]]:
        """Values of each axis, and the times of each sensor."""
        if self._loaded is None:
            text = b"".join(as_utf8(self.pieces())).decode(errors="replace")
            # a number that was cut off is another number
            lines = _lines(text[: text.rfind("\n") + 1] if self.ends_early else text)
            columns = SeriesColumns.of(lines[:1000])
            with self.named_errors():
                found = read_series(lines, columns) if columns else ({}, False)
            series, clocked = found
            arrays = arrays_of(series, CLOCK if clocked else TIME)
            self._loaded = {name: table_of(values) for name, values in arrays.items()}
        yield arrays_in_group(self.group, self._loaded)


def _lines(text: str) -> list[str]:
    """Lines that are neither empty nor what annotates others."""
    lines = (line.strip("\r\ufeff") for line in text.split("\n"))
    return [line for line in lines if line.strip() and not line.startswith("#")]
