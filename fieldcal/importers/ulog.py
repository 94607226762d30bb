"""PX4 logs (.ulg), read through pyulog, a piece of the log at a time.

Streams: ``sensor_accel.N``, what sensor N sends with its partner sensor_gyro (raw, in
the sensor's frame, with temperature), and ``sensor_combined.0``, what PX4 flies by:
turned into the body's frame, with CAL_ACCn_*, CAL_GYROn_* taken out. Of the several
slots n of that calibration, the one counts whose id is that of the sensor.

Message definitions and subscriptions are put before each piece, so that pyulog reads
a log of any length. A damaged log goes on at its next sync message. Source: PX4 user
guide, ULog File Format.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.drivers.mavlink_installed import PX4, Installed, names
from fieldcal.errors import InputError
from fieldcal.pairing import Pair
from fieldcal.recording import Recording, Stream, pieces
from fieldcal.samples import Array, Block

WHAT = "PX4 log, .ulg"

MAGIC = b"ULog\x01\x12\x35"
HEADER = 16

KNOWN = frozenset(b"BFIMPQALDOSRCGE")
"""Types of messages."""

SYNC = bytes((8, 0, ord("S"), 0x2F, 0x73, 0x13, 0x20, 0x25, 0x0C, 0xBB, 0x12))

COMBINED, ACCEL, GYRO = "sensor_combined", "sensor_accel", "sensor_gyro"

NOT_UPDATED = 0x7FFFFFFF
"""What accelerometer_timestamp_relative says where nothing new came."""

DATA = ord("D")

NEVER = 1 << 62
"""Where nothing was appended."""

Table = dict[str, Array]


def recognises(head: bytes, path: Path) -> bool:
    """Whether a file begins like a log."""
    return head.startswith(MAGIC)


class File(Recording):
    """A PX4 log."""

    def needs(self) -> tuple[tuple[str, ...], str]:
        """Return what reading it takes."""
        return ("pyulog",), "ulog"

    def streams(self) -> list[Stream]:
        """Sensors that have samples in the log."""
        self._scan()
        found = []
        there = {topic for n, topic in self._ids.items() if self._seen[n]}
        for topic, number in sorted(there):
            if topic == ACCEL:
                old = "x_raw" in self._fields(ACCEL)
                what = "calibrated by the driver" if old else "raw, sensor's frame"
                found.append(Stream(f"{ACCEL}.{number}", f"m/s^2, rad/s, {what}"))
            elif topic == COMBINED:
                what = "m/s^2, rad/s, calibrated, body's frame"
                found.append(Stream(f"{COMBINED}.{number}", what))
        if not found:
            raise InputError(
                f"{self.path}: has no {ACCEL} and no {COMBINED}; log them"
                " (SDLOG_PROFILE), and record again"
            )
        return found

    def notes(self, stream: str) -> dict[str, Any]:
        """What the log says of the sensor, and the calibration behind its samples."""
        self._scan()
        topic = stream.partition(".")[0]
        raw = topic == ACCEL and "x_raw" not in self._fields(ACCEL)
        identifier = self._identifier(stream)
        slot = self._slot("ACC", identifier)
        told = {
            "message": topic,
            "instance": int(stream.rpartition(".")[2]),
            "device_id": identifier,
            "acc_unit": "m/s^2",
            "gyr_unit": "rad/s",
            "hardware": str(self._info.get("ver_hw", "")),
        }
        if slot is None:
            return told | {"installed": None}
        wanted = [n for some in names(PX4, slot).values() for n in some]
        values = {n: self._params[n] for n in wanted if n in self._params}
        if raw:
            values |= {"SENS_BOARD_ROT": 0.0}
        installed = Installed(PX4, slot, values, taken_out=raw)
        return told | {"installed": installed.as_table()}

    def _identifier(self, stream: str) -> int | None:
        """Id of the accelerometer."""
        topic, _, number = stream.partition(".")
        if topic == COMBINED:
            prime = self._params.get("CAL_ACC_PRIME")
            return int(prime) if prime else None
        for tables in self._tables({(ACCEL, int(number))}):
            ids = tables.get((ACCEL, int(number)), {}).get("device_id")
            if ids is not None:
                return int(ids[0])
        return None

    def _slot(self, sensor: str, identifier: int | None) -> int | None:
        """Which set of parameters a sensor has."""
        ids = {n: self._params.get(f"CAL_{sensor}{n}_ID") for n in range(4)}
        slots = [n for n, value in ids.items() if value and value == identifier]
        return slots[0] if slots else None

    def blocks(self, stream: str) -> Iterator[Block]:
        """Samples of a sensor, a piece of the log at a time."""
        self._scan()
        try:
            yield from self._blocks(stream)
        except (KeyError, ValueError, TypeError) as error:
            raise InputError(
                f"{self.path}: {stream} is not defined as a sensor is ({error}); copy"
                " it again from where it came"
            ) from error

    def _blocks(self, stream: str) -> Iterator[Block]:
        topic, _, number = stream.partition(".")
        if topic == COMBINED:
            wanted = {(COMBINED, int(number))}
            for tables in self._tables(wanted):
                for table in tables.values():
                    yield _combined(table)
            return
        pair = Pair()
        for tables in self._tables({(ACCEL, int(number)), (GYRO, int(number))}):
            accel, gyro = (tables.get((t, int(number))) for t in (ACCEL, GYRO))
            block = pair.feed(
                _sensor(accel, "acc") if accel else None,
                _sensor(gyro, "gyr") if gyro else None,
            )
            if len(block):
                yield block
        rest = pair.rest()
        if len(rest):
            yield rest
        if pair.worst:
            self.says.append(
                "accelerometer and gyroscope have times of their own: paired with the"
                f" nearest, {pair.worst * 1e3:.3g} ms apart at most"
            )

    def _fields(self, topic: str) -> str:
        return self._formats.get(topic, "")

    _scanned = False

    def _scan(self) -> None:
        """Walk through the log once: what is in it, and its parameters."""
        if self._scanned:
            return
        from pyulog import ULog

        self._head, self._subscribed = b"", b""
        self._ids: dict[int, tuple[str, int]] = {}
        self._seen = [0] * 65536
        self._appended: list[int] = []
        for _ in self._messages(set(), scan=True):
            pass
        with contextlib.redirect_stdout(io.StringIO()):
            try:
                read = ULog(io.BytesIO(self._head))
            except Exception as error:
                # a spoilt definition makes pyulog raise what it likes
                raise InputError(
                    f"{self.path}: its definitions cannot be read: {error}; copy it"
                    " again from where it came"
                ) from error
        self._info = read.msg_info_dict
        self._params = {
            k: float(v)
            for k, v in read.initial_parameters.items()
            if isinstance(v, int | float)
        }
        self._formats = {
            name: " ".join(field for *_, field in f.fields)
            for name, f in read.message_formats.items()
        }
        self._scanned = True

    def _tables(
        self, wanted: set[tuple[str, int]]
    ) -> Iterator[dict[tuple[str, int], Table]]:
        """What pyulog makes of each piece of the log."""
        from pyulog import ULog

        for data in self._messages(wanted, scan=False):
            with contextlib.redirect_stdout(io.StringIO()):
                try:
                    read = ULog(io.BytesIO(self._head + self._subscribed + data))
                except Exception as error:
                    # as above
                    raise InputError(
                        f"{self.path}: cannot be read: {error}; copy it again from"
                        " where it came"
                    ) from error
            yield {
                (item.name, item.multi_id): item.data
                for item in read.data_list
                if (item.name, item.multi_id) in wanted
            }

    def _messages(self, wanted: set[tuple[str, int]], scan: bool) -> Iterator[bytes]:
        """Walk through the log; messages of wanted topics, a piece at a time."""
        rest, base, begun = b"", 0, False
        for piece in pieces(self.path):
            data = rest + piece
            at = 0
            if not begun:
                if len(data) < HEADER:
                    rest = data
                    continue
                at, begun = HEADER, True
                if scan:
                    self._head = data[:HEADER]
            out, at = self._walk(data, at, base, wanted, scan)
            rest, base = data[at:], base + at
            if out:
                yield out
        if scan and (rest or not begun):
            self.says.append(f"the log ends within a message, at byte {base}")

    def _walk(
        self, data: bytes, at: int, base: int, wanted: set[tuple[str, int]], scan: bool
    ) -> tuple[bytes, int]:
        """Wanted messages of a stretch, and where the next message begins."""
        ids = {n for n, topic in self._ids.items() if topic in wanted}
        out, size = bytearray(), len(data)
        jumps = [offset - base for offset in self._appended if offset >= base]
        jump = jumps[0] if jumps else NEVER
        counts = self._seen
        while at + 3 <= size:
            end = at + 3 + (data[at] | data[at + 1] << 8)
            kind = data[at + 2]
            # nearly all messages are data, so these come first and go fast
            if kind == DATA and at + 5 <= end <= size and not at < jump < end:
                number = data[at + 3] | data[at + 4] << 8
                if scan:
                    counts[number] += 1
                elif number in ids:
                    out += data[at:end]
                at = end
                continue
            if end > jump > at:
                # what follows was appended after a crash had cut a message
                at, jumps = jump, jumps[1:]
                jump = jumps[0] if jumps else NEVER
                continue
            if kind not in KNOWN or end == at + 3:
                back = data.find(SYNC, at)
                if scan:
                    self.damaged(f"byte {base + at}", "is no message of a log")
                if back < 0:
                    keep = max(at, size - len(SYNC) + 1)
                    return bytes(out), max(keep, at + 1)
                at = back
                continue
            if end > size:
                break
            if scan:
                self._define(kind, data[at:end])
            at = end
        return bytes(out), at

    def _define(self, kind: int, message: bytes) -> None:
        """Keep what defines the messages that follow."""
        if kind in b"FIPQM" and not self._ids:
            self._head += message
        elif kind == ord("B"):
            offsets = np.frombuffer(message[19:43], "<u8")
            self._appended = sorted(int(o) for o in offsets if o)
        elif kind == ord("A") and len(message) > 6:
            number = message[4] | message[5] << 8
            name = message[6:].decode("ascii", errors="replace")
            self._ids[number] = (name, message[3])
            self._subscribed += message


def _combined(table: Table) -> Block:
    acc = _three(table, "accelerometer_m_s2[{}]", "012")
    relative = table.get("accelerometer_timestamp_relative")
    if relative is not None:
        acc[np.asarray(relative) == NOT_UPDATED] = np.nan
    gyr = _three(table, "gyro_rad[{}]", "012")
    return Block.of(table["timestamp"] * 1e-6, acc, gyr)


def _three(table: Table, pattern: str, axes: str) -> Array:
    columns = [np.asarray(table[pattern.format(axis)], dtype=float) for axis in axes]
    return np.column_stack(columns)


def _stamps(table: Table) -> Array:
    return np.asarray(table.get("timestamp_sample", table["timestamp"])) * 1e-6


def _sensor(table: Table, kind: str) -> Block:
    """Samples of one sensor; the other's are unknown."""
    three, t = _three(table, "{}", "xyz"), _stamps(table)
    if kind == "acc":
        return Block.of(t, three, None, table.get("temperature"))
    return Block.of(t, np.full(three.shape, np.nan), three)
