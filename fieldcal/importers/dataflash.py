"""ArduPilot dataflash logs (.bin): messages IMU, IMU2, IMU3, and ISBH with ISBD.

What is in the former is calibrated and turned into the body's frame: INS_ACCOFFS,
INS_ACCSCAL and INS_GYROFFS are taken out, and come along from the PARM messages. The
latter are batches at the sensor's own rate, raw where bit 0 of INS_LOG_BAT_OPT is set;
their numbers are cut toward zero, see `mavlink_units`.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block
from fieldcal.drivers.mavlink_installed import InstalledCalibration
from fieldcal.drivers.mavlink_parameter_names import ARDUPILOT, parameter_names
from fieldcal.drivers.mavlink_units import untruncated_mean
from fieldcal.importing.messages.dataflash_messages import (
    BODY,
    FMT,
    HEAD,
    INSTANCES,
    MARK,
    DataflashMessages,
)
from fieldcal.importing.recording import ImuStream, Recording
from fieldcal.importing.times.fifo_time import FifoBatch, FifoBatches
from fieldcal.importing.words.sensor_words import AXES

WHAT = "ArduPilot dataflash log, .bin"

OPTION, RAW = "INS_LOG_BAT_OPT", 1
"""Parameter, and its bit by which batches are taken before anything is corrected."""


def recognises(head: bytes, path: Path) -> bool:
    """Whether a file begins with a definition of a message."""
    return head.startswith(MARK + bytes((FMT,)))


class DataflashLog(Recording):
    """A dataflash log."""

    def needs(self) -> tuple[tuple[str, ...], str]:
        """Return what reading it takes."""
        return ("pymavlink",), "mavlink"

    def streams(self) -> list[ImuStream]:
        """Sensors that have samples in the log."""
        self._scan()
        if not self._sensors and not self._sampled:
            raise InputError(
                f"{self.path}: has no IMU message and no batch of samples; set"
                " LOG_BITMASK to log the IMU, and record again"
            )
        says = "m/s^2, rad/s, calibrated, body's frame"
        found = [ImuStream(f"IMU.{n}", says) for n in sorted(self._sensors)]
        says = f"m/s^2, rad/s, batches, {self._state()}"
        return found + [ImuStream(f"{BODY}.{n}", says) for n in sorted(self._sampled)]

    def _state(self) -> str:
        """What was done to the samples of batches before they were written."""
        option = self._params.get(OPTION)
        if option is None:
            return "raw or calibrated: the log lacks " + OPTION
        raw = int(option) & RAW
        return "raw, sensor's frame" if raw else "calibrated, body's frame"

    def notes(self, stream: str) -> dict[str, Any]:
        """Return what the autopilot had installed while it logged."""
        self._scan()
        message, _, last = stream.rpartition(".")
        number = int(last)
        wanted = [
            n for some in parameter_names(ARDUPILOT, number).values() for n in some
        ]
        values = {n: self._params[n] for n in wanted if n in self._params}
        raw = message == BODY and int(self._params.get(OPTION, 0)) & RAW
        if raw:
            values |= {"AHRS_ORIENTATION": 0.0}
        installed = InstalledCalibration(ARDUPILOT, number, values, taken_out=bool(raw))
        told: dict[str, Any] = {}
        if message == BODY:
            acc, gyr = self._sampled[number]
            told["grain"] = {"acc": acc, "gyr": gyr, "cut": True}
            told["samples"] = self._state()
        return told | {
            "message": message,
            "instance": number,
            "acc_unit": "m/s^2",
            "gyr_unit": "rad/s",
            "installed": installed.as_table() if values else None,
        }

    def blocks(self, stream: str) -> Iterator[Block]:
        """Samples of one sensor, a piece of the log at a time."""
        self._scan()
        message, _, last = stream.rpartition(".")
        number = int(last)
        if message == BODY:
            yield from self._batches(number)
            return
        for found in self._log.tables(set(INSTANCES)):
            for name, table in found.items():
                mine = table[_sensor(name, table) == number]
                if len(mine):
                    yield self._block(mine, name)

    def _block(self, table: NDArray[np.void], name: str) -> Block:
        def column(column: str) -> Array:
            factor = self._log.factor(name, column)
            with np.errstate(invalid="ignore"):  # a NaN that signals is one as well
                values: Array = table[column].astype(float) * factor
            return values

        there = table.dtype.names or ()
        whole = "TimeUS" in there
        stamp = 1e-6 * column("TimeUS") if whole else 1e-3 * column("TimeMS")
        degrees = next((column(n) for n in ("T", "Temp") if n in there), None)
        return Block.of(
            stamp,
            np.column_stack([column(f"Acc{axis}") for axis in "XYZ"]),
            np.column_stack([column(f"Gyr{axis}") for axis in "XYZ"]),
            degrees,
        )

    def _batches(self, number: int) -> Iterator[Block]:
        """Samples of the batches of one device."""
        batches, scales = FifoBatches(), dict[int, float]()
        for found in self._log.tables({HEAD, BODY}):
            for row in found.get(HEAD, ()):
                told = row["mul"] and row["smp_rate"] > 0 and row["smp_cnt"]
                if row["instance"] == number and told:
                    scales[int(row["N"])] = 1 / float(row["mul"])
                    batches.begin(int(row["N"]), _batch(row))
            for row in found.get(BODY, ()):
                values = np.column_stack([row[axis] for axis in AXES]).astype(float)
                scale = scales.get(int(row["N"]), np.nan)
                part = scale * untruncated_mean(values)
                yield from batches.feed(int(row["N"]), int(row["seqno"]), part)
            batches.forget()
        yield from batches.rest()
        if batches.lost:
            many = "a batch" if batches.lost == 1 else f"{batches.lost} batches"
            self.says.append(f"{many} of which a part is missing: left out")

    _scanned = False

    def _scan(self) -> None:
        """Walk through the log once: which sensors it has, and the parameters."""
        if self._scanned:
            return
        self._log = DataflashMessages(self.damaged, self.pieces)
        self._sensors: set[int] = set()
        self._sampled: dict[int, tuple[float, float]] = {}
        self._params: dict[str, float] = {}
        for found in self._log.tables({*INSTANCES, "PARM", HEAD}, scan=True):
            for name, table in found.items():
                if name in INSTANCES:
                    self._sensors.update(_sensor(name, table).tolist())
                    continue
                if name == HEAD:
                    self._note_steps(table)
                    continue
                for row in table:
                    key = bytes(row["Name"]).rstrip(b"\0").decode("ascii", "replace")
                    if np.isfinite(row["Value"]):
                        self._params[key] = float(row["Value"])
        if self._log.cut is not None:
            self.says.append(f"the log ends within a message, at byte {self._log.cut}")
        self._scanned = True

    def _note_steps(self, table: NDArray[np.void]) -> None:
        """Keep which devices are sampled in batches, and the steps of their numbers."""
        for row in table[table["mul"] > 0]:
            steps = list(self._sampled.get(int(row["instance"]), (0.0, 0.0)))
            steps[int(row["type"] != 0)] = 1 / float(row["mul"])
            self._sampled[int(row["instance"])] = (steps[0], steps[1])


def _batch(row: np.void) -> FifoBatch:
    return FifoBatch(
        gyro=bool(row["type"]),
        start=1e-6 * float(row["SampleUS"]),
        period=1 / float(row["smp_rate"]),
        length=int(row["smp_cnt"]),
    )


def _sensor(name: str, table: NDArray[np.void]) -> NDArray[np.int64]:
    """Which sensor each message speaks of."""
    if name == "IMU" and "I" in (table.dtype.names or ()):
        return table["I"].astype(np.int64)
    return np.full(len(table), INSTANCES[name])
