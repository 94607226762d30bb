"""PX4 logs (.ulg): definitions through pyulog, samples a piece of the log at a time.

Streams, of sensor N with its partner, the gyroscope of the same device:

    sensor_accel_fifo.N    every sample the sensor took, raw, in the sensor's frame
    sensor_accel.N         filtered and thinned out by the driver, with temperature
    sensor_combined.0      what PX4 flies by: turned into the body's frame, with
                           CAL_ACCn_*, CAL_GYROn_* taken out
    vehicle_imu.N          integrals over some ms, likewise corrected; only where a log
                           has none of the others

Of the several slots n of that calibration, the one counts whose id is that of the
sensor. Source: message definitions of PX4.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block, concat
from fieldcal.drivers.mavlink_installed import InstalledCalibration
from fieldcal.drivers.mavlink_parameter_names import PX4, parameter_names
from fieldcal.importing.messages.ulog_fifo import FifoReader
from fieldcal.importing.messages.ulog_messages import Table, Topic, UlogMessages
from fieldcal.importing.recording import ImuStream, Recording
from fieldcal.importing.times.alignment import AlignedPair
from fieldcal.importing.times.row_validator import RowValidator

WHAT = "PX4 log, .ulg"

MAGIC = b"ULog\x01\x12\x35"

COMBINED, INTEGRALS = "sensor_combined", "vehicle_imu"

PARTNERS = {"sensor_accel_fifo": "sensor_gyro_fifo", "sensor_accel": "sensor_gyro"}
"""Topics of accelerometers, and of the gyroscopes that go with them."""

SAYS = {
    "sensor_accel_fifo": "m/s^2, rad/s, raw, sensor's frame, every sample",
    "sensor_accel": "m/s^2, rad/s, raw, sensor's frame",
    COMBINED: "m/s^2, rad/s, calibrated, body's frame",
    INTEGRALS: "m/s^2, rad/s, calibrated, body's frame, means over each integral",
}

NOT_UPDATED = 0x7FFFFFFF
"""What accelerometer_timestamp_relative says where nothing new came."""


def recognises(head: bytes, path: Path) -> bool:
    """Whether a file begins like a log."""
    return head.startswith(MAGIC)


class UlogFile(Recording):
    """A PX4 log."""

    def needs(self) -> tuple[tuple[str, ...], str]:
        """Return what reading it takes."""
        return ("pyulog",), "ulog"

    def streams(self) -> list[ImuStream]:
        """Sensors that have samples in the log."""
        there = self._log.topics
        some = [(t, n) for t, n in sorted(there) if t in SAYS and t != INTEGRALS]
        found = some or [(t, n) for t, n in sorted(there) if t == INTEGRALS]
        if not found:
            raise InputError(
                f"{self.path}: has none of {', '.join(SAYS)}; log them"
                " (SDLOG_PROFILE), and record again"
            )
        return [ImuStream(f"{topic}.{n}", self._what(topic)) for topic, n in found]

    def _what(self, topic: str) -> str:
        if topic == "sensor_accel" and not self._raw(topic):
            return "m/s^2, rad/s, calibrated by the driver"
        return SAYS[topic]

    def _raw(self, topic: str) -> bool:
        """Whether no calibration has been taken out of a topic."""
        return topic in PARTNERS and "x_raw" not in self._log.formats.get(topic, ())

    def notes(self, stream: str) -> dict[str, Any]:
        """What the log says of the sensor, and the calibration behind its samples."""
        topic, number = _split_stream(stream)
        raw = self._raw(topic)
        identifier = self._identifier(topic, number)
        told = {
            "message": topic,
            "instance": number,
            "device_id": identifier,
            "acc_unit": "m/s^2",
            "gyr_unit": "rad/s",
            "hardware": str(self._log.info.get("ver_hw", "")),
        }
        if topic == "sensor_accel_fifo":
            gyro = (PARTNERS[topic], self._partner(topic, number))
            steps = [self._first(some, "scale") for some in ((topic, number), gyro)]
            acc, gyr = (step or 0.0 for step in steps)
            told["grain"] = {"acc": acc, "gyr": gyr, "cut": False}
        slot = self._slot("ACC", identifier)
        if slot is None:
            return told | {"installed": None}
        gyroscope = self._gyroscope(topic, number)
        other = self._slot("GYRO", gyroscope)
        params = self._log.parameters
        # without an own set, those of the accelerometer's number are another sensor's
        strange = other is None and gyroscope and self._has_slots("GYRO")
        other = None if other == slot else other
        names = parameter_names(PX4, slot, other)
        if strange:
            del names["gyr_offset"]
        values = {n: params[n] for some in names.values() for n in some if n in params}
        if raw:
            values |= {"SENS_BOARD_ROT": 0.0}
        installed = InstalledCalibration(
            PX4, slot, values, taken_out=raw, gyr_instance=other
        )
        return told | {"installed": installed.as_table()}

    def _identifier(self, topic: str, number: int) -> int | None:
        """Id of the accelerometer."""
        if topic == COMBINED:
            prime = self._log.parameters.get("CAL_ACC_PRIME")
            return int(prime) if prime else None
        field = "accel_device_id" if topic == INTEGRALS else "device_id"
        found = self._first((topic, number), field)
        return None if found is None else int(found)

    def _first(self, topic: tuple[str, int], field: str) -> float | None:
        """Return the first value of a field."""
        if topic in self._log.topics and field in self._log.formats.get(topic[0], ()):
            with self._sensible(topic[0]):
                for tables in self._log.tables({topic}):
                    if topic in tables:
                        return float(tables[topic][field][0])
        return None

    def _partner(self, topic: str, number: int) -> int:
        """Instance of the gyroscope of the same device, or else of the same number."""
        gyro = PARTNERS[topic]
        mine = self._first((topic, number), "device_id")
        there = sorted(n for name, n in self._log.topics if name == gyro)
        same = [n for n in there if self._first((gyro, n), "device_id") == mine]
        return same[0] if mine and len(same) == 1 else number

    def _gyroscope(self, topic: str, number: int) -> int | None:
        """Id of the gyroscope; None if the log does not say it."""
        if topic in PARTNERS:
            where = PARTNERS[topic], self._partner(topic, number)
            found = self._first(where, "device_id")
        else:
            found = self._first((topic, number), "gyro_device_id")
        return None if found is None else int(found)

    def _slot(self, triad: str, identifier: int | None) -> int | None:
        """Which set of parameters of ACC or GYRO, each with its own, a sensor has."""
        ids = {n: self._log.parameters.get(f"CAL_{triad}{n}_ID") for n in range(4)}
        slots = [n for n, value in ids.items() if value and value == identifier]
        return slots[0] if slots else None

    def _has_slots(self, triad: str) -> bool:
        """Whether the log says of which sensors its sets of parameters are."""
        names = (f"CAL_{triad}{n}_ID" for n in range(4))
        return any(self._log.parameters.get(name) for name in names)

    def blocks(self, stream: str) -> Iterator[Block]:
        """Samples of a sensor, a piece of the log at a time."""
        topic, number = _split_stream(stream)
        with self._sensible(topic):
            if topic in PARTNERS:
                yield from self._pairs(topic, number)
                return
            reads = _combined if topic == COMBINED else _integrals
            for tables in self._log.tables({(topic, number)}):
                for table in tables.values():
                    yield reads(table)

    def _pairs(self, topic: str, number: int) -> Iterator[Block]:
        mine = (topic, number)
        other = (PARTNERS[topic], self._partner(topic, number))
        both = {mine, other} & self._log.topics
        flow = (
            {some: _as_rates(block) if some == other else block
             for some, block in read.items()}
            for read in self._read_tables(both)
        )  # fmt: skip
        if other not in both:
            yield from (block for read in flow for block in read.values())
            return
        yield from self._judged(mine, other, flow)
        if other[1] != number:
            stream = f"{topic}.{number}"
            self.says.append(
                f"{stream} goes with {other[0]}.{other[1]}, the gyroscope of the same"
                " device"
            )

    def _read_tables(self, topics: set[Topic]) -> Iterator[dict[Topic, Block]]:
        """Samples of sensors, each as if of an accelerometer."""
        fifos = {some: FifoReader(_stamps) for some in topics if "fifo" in some[0]}
        for tables in self._log.tables(topics):
            yield {
                some: fifos[some].read(table) if some in fifos else _sensor(table)
                for some, table in tables.items()
            }
        yield {some: fifo.rest() for some, fifo in fifos.items()}

    def _judged(
        self, acc: Topic, gyr: Topic, flow: Iterable[Mapping[Topic, Block]]
    ) -> Iterator[Block]:
        """Samples of both sensors whose times can be, paired."""
        pair = AlignedPair()
        judges = {
            topic: RowValidator(str(self.path), partial(_sample_of, topic), self.repair)
            for topic in (acc, gyr)
        }
        for read in flow:
            good = {some: judges[some].feed(block) for some, block in read.items()}
            block = pair.feed(good.get(acc), good.get(gyr))
            if len(block):
                yield block
        last = pair.feed(judges[acc].rest(), judges[gyr].rest())
        if len(rest := concat([last, pair.rest()])):
            yield rest
        for judge in judges.values():
            self.mended += judge.mended
            self.says += judge.says
        if pair.worst:
            self.says.append(
                "accelerometer and gyroscope have times of their own: paired with the"
                f" nearest, {pair.worst * 1e3:.3g} ms apart at most"
            )

    @contextmanager
    def _sensible(self, topic: str) -> Iterator[None]:
        """Say of a topic that it is not what its name says."""
        try:
            yield
        except (KeyError, ValueError, TypeError) as error:
            raise InputError(
                f"{self.path}: {topic} is not defined as a sensor is ({error}); copy it"
                " again from where it came"
            ) from error

    _read: UlogMessages | None = None

    @property
    def _log(self) -> UlogMessages:
        """The log, walked through once."""
        if self._read is None:
            self._read = UlogMessages(self.path, self.damaged, self.pieces)
            if self._read.cut is not None:
                self.says.append(
                    f"the log ends within a message, at byte {self._read.cut}"
                )
        return self._read


def _split_stream(stream: str) -> tuple[str, int]:
    topic, _, number = stream.rpartition(".")
    return topic, int(number)


def _sample_of(topic: Topic, number: int) -> str:
    """Name a sample of a sensor, counted from 0."""
    return f"sample {number + 1} of {topic[0]}.{topic[1]}"


def _combined(table: Table) -> Block:
    acc = _axis_columns(table, "accelerometer_m_s2[{}]", "012")
    relative = table.get("accelerometer_timestamp_relative")
    if relative is not None:
        acc[np.asarray(relative) == NOT_UPDATED] = np.nan
    gyr = _axis_columns(table, "gyro_rad[{}]", "012")
    return Block.of(table["timestamp"] * 1e-6, acc, gyr)


def _integrals(table: Table) -> Block:
    """Means over the time of each integral, at its middle."""
    triads = []
    for name in ("delta_velocity", "delta_angle"):
        seconds = 1e-6 * table[f"{name}_dt"].astype(float)
        usual = np.where(seconds > 0, seconds, np.nan)[:, None]
        triads.append(_axis_columns(table, f"{name}[{{}}]", "012") / usual)
    middle = 0.5e-6 * table["delta_velocity_dt"]
    return Block.of(_stamps(table) - middle, *triads)


def _sensor(table: Table) -> Block:
    """Samples of one sensor, as if of an accelerometer."""
    temperature = table.get("temperature")
    return Block.of(
        _stamps(table), _axis_columns(table, "{}", "xyz"), None, temperature
    )


def _axis_columns(table: Table, pattern: str, parts: Iterable[object]) -> Array:
    with np.errstate(invalid="ignore"):  # of a nan that signals
        some = [np.asarray(table[pattern.format(p)], dtype=float) for p in parts]
    return np.column_stack(some)


def _stamps(table: Table) -> Array:
    return np.asarray(table.get("timestamp_sample", table["timestamp"])) * 1e-6


def _as_rates(block: Block) -> Block:
    """Samples of a gyroscope that were read as if of an accelerometer."""
    return Block.of(block.t, np.full(block.acc.shape, np.nan), block.acc)
