"""Texts with a table for each sensor, one below the other.

What tells such a text may stand far below its first lines: where these are a table of
one sensor alone, the lines behind are looked through for one of the other.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import islice, takewhile
from pathlib import Path

from fieldcal.core.errors import InputError
from fieldcal.importers.arrays import ArrayFile
from fieldcal.importing.arrays.array_groups import arrays_in_group
from fieldcal.importing.arrays.array_tables import ArrayTable, table_of
from fieldcal.importing.files.packed_stream import PIECE, unpacked_pieces
from fieldcal.importing.files.text_encoding import as_utf8, is_mostly_text
from fieldcal.importing.records.sensor_blocks import (
    SENSOR,
    joined_blocks,
    sensor_blocks,
)
from fieldcal.importing.text.text_lines import TOP, split_lines
from fieldcal.importing.text.text_top import find_stated_rate

WHAT = "text with a table for each sensor, one below the other"

FEWEST = 10
"""Rows of a table: lines that come in turn are read as such."""


def recognises(head: bytes, path: Path) -> bool:
    """Whether a text begins with one sensor alone, and holds the other below."""
    if not is_mostly_text(head):
        return False
    (top,) = [*as_utf8([head])] or [b""]
    blocks = [*sensor_blocks(split_lines(top)[:-1])]
    in_turn = any(len(one.rows) < FEWEST for one in blocks[:-1])
    if not blocks or in_turn or not blocks[0].sensor:
        return False
    whole = _lines(unpacked_pieces(path, PIECE, lambda where, what: None))
    return _hold_both(whole)


def _hold_both(lines: Iterator[str]) -> bool:
    """Whether lines hold a table of each sensor."""
    missing = {*SENSOR.values()}
    blocks = takewhile(lambda one: bool(missing), sensor_blocks(lines))
    for one in blocks:
        missing -= {one.sensor}
    return not missing


def _lines(pieces: Iterator[bytes]) -> Iterator[str]:
    """Lines of a text that are not empty."""
    rest = b""
    for piece in as_utf8(pieces):
        whole, _, rest = (rest + piece).rpartition(b"\n")
        yield from split_lines(whole)
    yield from split_lines(rest)


class SensorTables(ArrayFile):
    """Tables of sensors, with one IMU in them or several."""

    def needs(self) -> tuple[tuple[str, ...], str]:
        """Return what reading it takes: nothing."""
        return (), ""

    def rate_said(self) -> tuple[float, str] | None:
        """Rate that a line at the top says."""
        return find_stated_rate([*islice(self.text_lines(), TOP)], None)

    @contextmanager
    def _whole_arrays(self) -> Iterator[dict[str, ArrayTable]]:
        """Columns of each table.

        Raises
        ------
        InputError
            If it has no table of one of the sensors, as where it was cut off.

        """
        if self._loaded is None:
            blocks = joined_blocks(sensor_blocks(self.text_lines()))
            if not {*SENSOR.values()} <= {one.sensor for one in blocks}:
                raise InputError(
                    f"{self.path}: has not a table of each sensor: copy it again from"
                    " where it came, or import the one with fieldcal import --format"
                    " csv_like"
                )
            self._loaded = {
                name: table_of(values, unit)
                for one in blocks
                for name, values, unit in one.arrays()
            }
        yield arrays_in_group(self.group, self._loaded)

    def text_lines(self) -> Iterator[str]:
        """Lines of the text; a number that was cut off is another number."""
        lines = [*_lines(self.pieces())]
        return iter(lines[:-1] if self.ends_early else lines)
