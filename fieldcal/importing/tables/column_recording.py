"""A recording in columns: the user, names or physics say what each of them is."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np

from fieldcal.core.samples import CHANNELS, Array, Block
from fieldcal.importing import columns
from fieldcal.importing.headings.heading import (
    NAMES,
    Column,
    Heading,
)
from fieldcal.importing.headings.sensor_columns import of_sensor
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.recording import ImuStream, MeanScatter, Recording
from fieldcal.importing.tables.column_clock import ColumnClock, ask_rate
from fieldcal.importing.tables.column_finder import ColumnFinder
from fieldcal.importing.tables.column_source import column_numbers, holds_means
from fieldcal.importing.tables.means import row_scatter
from fieldcal.importing.tables.own_times import OwnTimes, SensorsApart
from fieldcal.importing.tables.scatter_columns import scatter_columns
from fieldcal.importing.tables.table_speeds import speed_columns, speed_unit
from fieldcal.importing.text.rows_in_turn import RowsInTurn
from fieldcal.importing.times.row_validator import RowValidator
from fieldcal.importing.times.slower_sensor import SlowerSensor
from fieldcal.importing.words.file_names import SENSOR, sensor_of_file_name


class ColumnRecording(Recording):
    """A file of columns, with one IMU in it or several side by side."""

    asks_units = True
    imus_found: dict[str, ReadOptions] | None = None
    """Options of each IMU by its name, once they were looked for."""

    in_turn = False
    """Whether its rows hold the accelerometer or the gyroscope, as far as is known."""

    _own_times: OwnTimes | None = None
    """Times of each sensor, where they are not the same."""

    told_by = NAMES
    """What says the sensor of its columns."""

    @abstractmethod
    def heading(self) -> list[Heading]:
        """What may be read as names of its columns, the likeliest first."""

    @abstractmethod
    def beginning(self) -> Array:
        """Numbers of the first rows, (n, k); nan where a cell is none. May be empty."""

    @abstractmethod
    def ask(self) -> str:
        """What to do where nothing tells its columns."""

    @abstractmethod
    def read_samples(self) -> Iterator[Block]:
        """Samples of the one IMU in it, row by row as they stand."""

    def rate_said(self) -> tuple[float, str] | None:
        """Sampling rate, Hz, that the file says of itself, and where; or None."""
        return None

    def streams(self) -> list[ImuStream]:
        """Return the IMUs in it."""
        found = self.imus()
        for wanted in found.values():
            ask_rate(self, wanted)
            columns.check_columns(wanted)
        return [
            ImuStream(name, f"columns in {columns.describe_units(wanted)}")
            for name, wanted in found.items()
        ]

    def notes(self, stream: str) -> dict[str, Any]:
        """Return the units."""
        return columns.unit_notes(self.wanted)

    def alone(self, stream: str) -> Recording:
        """The recording with the columns of one IMU."""
        wanted = self.imus()[stream]
        one = super().alone(stream)
        one.wanted = wanted
        if isinstance(one, ColumnRecording):
            one.imus_found = {stream: wanted}
        return one

    def imus(self) -> dict[str, ReadOptions]:
        """Options of each IMU by its name."""
        if self.imus_found is None:
            own = not self.wanted.columns
            found = self._found()
            self.imus_found = {
                name: ColumnClock(self, one, own).settled for name, one in found.items()
            }
            if len(self.imus_found) == 1:
                (self.wanted,) = self.imus_found.values()
        if len(self.imus_found) == 1:
            # units may have been found meanwhile
            return dict.fromkeys(self.imus_found, self.wanted)
        return self.imus_found

    def blocks(self, stream: str) -> Iterator[Block]:
        """Samples of an IMU, also where each row holds one of two sensors alone."""
        if len(self.imus()) > 1:
            yield from self.alone(stream).blocks(stream)
            return
        slower, own = SlowerSensor(), self._own_times
        whole = self._sensors_apart(own) if own is not None else self._in_rows()
        yield from slower.through(whole)
        self.says += [s for s in slower.says if s not in self.says]

    def _in_rows(self) -> Iterator[Block]:
        """Samples of rows that hold both sensors, or one of them each."""
        rows = RowsInTurn(str(self.path), self.repair)
        for block in rows.through(self.read_samples()):
            self.in_turn = rows.told
            yield block
        self.says += [s for s in rows.says if s not in self.says]
        self.mended += [s for s in rows.mended if s not in self.mended]

    def _sensors_apart(self, times: OwnTimes) -> Iterator[Block]:
        """Samples of sensors that have times of their own, each with the nearest."""
        both = []
        for wanted in times.options(self.wanted):
            one = copy(self)
            one.says, one.mended, one.wanted, one.from_first = [], [], wanted, False
            both.append(one)
        judges = [RowValidator(str(one.path), one.place, one.repair) for one in both]
        apart = SensorsApart(str(self.path), judges)
        for block in apart.through(*(one.read_samples() for one in both)):
            self.began = apart.began
            since = apart.began if self.from_first and len(block) else 0.0
            yield replace(block, t=block.t - since)
        for one, judge in zip(both, judges, strict=True):
            says, mended = [*one.says, *judge.says], [*one.mended, *judge.mended]
            self.says += [s for s in says if s not in self.says]
            self.mended += [s for s in mended if s not in self.mended]
        self.says.append(apart.sentence)

    def named_by_file(self, columns: Sequence[Column]) -> list[Column]:
        """Columns of which bare axes are those of the sensor the file is called by."""
        stem = self.path.name.split(".")[0]
        sensor = self.sensor or sensor_of_file_name(stem)
        named = [of_sensor(sensor, one) for one in columns] if sensor else [*columns]
        if named != [*columns] and not self.sensor:
            said = f"its axes are those of the {SENSOR[sensor]}, as the file is called"
            self.says += [said] if said not in self.says else []
            self.told_by = "the names of its columns and of the file"
        return named

    def scatter(self) -> MeanScatter | None:
        """What its columns say of the scatter, if its rows are means."""
        table, wanted = self.beginning(), self.wanted
        if not holds_means(self, wanted):
            return None
        at = column_numbers(self, wanted)
        fits = (w for w in self.heading() if len(w.columns) == table.shape[1])
        named = next(fits, Heading([])).columns
        where = scatter_columns(named)
        means, values = (_columns_of(table, places) for places in (at, where))
        count = table[:, where["n"]] if "n" in where else None
        timed, speed = columns.has_time(wanted.columns), speed_columns(named)
        if not speed or {*speed} & {i for c, i in at.items() if c != columns.SKIP}:
            return MeanScatter(means, values, count, timed)
        unit, said = speed_unit(named[speed[0]]), table[:, speed]
        # the sign of the rate about a single axis is nobody's question
        length = said[:, 0] if len(speed) == 1 else np.linalg.norm(said, axis=1)
        return MeanScatter(means, values, count, timed, length, unit)

    def row_sigma(self, gravity: float) -> float | None:
        """Standard deviation of its rows, m/s^2, if each may be a position."""
        table, at = self.beginning(), column_numbers(self, self.wanted)
        if not {"ax", "ay", "az"} <= set(at) or not len(table):
            return None
        acc = table[:, [at["ax"], at["ay"], at["az"]]] * self.wanted.acc_scale
        return row_scatter(acc[np.isfinite(acc).all(axis=1)], gravity)

    def _found(self) -> dict[str, ReadOptions]:
        """Options of each IMU by its name, as the user, names or physics say."""
        finder = ColumnFinder(self)
        found = finder.imus()
        self._own_times = finder.own_times
        return found


def _columns_of(table: Array, places: Mapping[str, int]) -> Array:
    """Numbers (n, 6) of the channels that stand in a table; nan of others."""
    found = np.full((len(table), len(CHANNELS)), np.nan)
    for i, channel in enumerate(CHANNELS):
        if channel in places:
            found[:, i] = table[:, places[channel]]
    return found
