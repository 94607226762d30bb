"""MAVLink telemetry logs (.tlog): RAW_IMU, SCALED_IMU, 2, 3, HIGHRES_IMU.

A stream is a message of a sensor, such as ``RAW_IMU.0`` or ``HIGHRES_IMU.0``; where
several vehicles talk, system and component stand before it: ``1.1.RAW_IMU.0``. What is
in them is calibrated; parameters that were sent meanwhile come along. Units are told by
gravity, see `mavlink_units`, or named: ``--options "acc_unit=mg&rounding=nearest"``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fieldcal.core.errors import DeviceError, InputError
from fieldcal.core.samples import Block
from fieldcal.drivers.mavlink_frames import HEADER_BYTES, VERSION_2
from fieldcal.drivers.mavlink_installed import InstalledCalibration
from fieldcal.drivers.mavlink_log import STAMP_BYTES, split_log, split_whole_packets
from fieldcal.drivers.mavlink_parameter_names import parameter_names
from fieldcal.drivers.options import Options
from fieldcal.drivers.reader import Chunk
from fieldcal.importing.recording import ImuStream, Recording

if TYPE_CHECKING:
    from fieldcal.drivers.mavlink_samples import MavlinkDecoder

WHAT = "MAVLink telemetry log, .tlog"

CUT = 1 << 20
"""Bytes looked at together."""

YEARS = (946_684_800e6, 4_102_444_800e6)
"""µs since 1970 between which a stamp is one: 2000 to 2100."""


def recognises(head: bytes, path: Path) -> bool:
    """Whether stamps and packets follow one another."""
    at, many = 0, 0
    while at + STAMP_BYTES + 3 <= len(head) and many < 8:
        stamp = int.from_bytes(head[at : at + STAMP_BYTES], "big")
        kind = head[at + STAMP_BYTES]
        if kind not in HEADER_BYTES or not YEARS[0] < stamp < YEARS[1]:
            return False
        signed = kind == VERSION_2 and head[at + STAMP_BYTES + 2] & 1
        at += (
            STAMP_BYTES
            + HEADER_BYTES[kind]
            + head[at + STAMP_BYTES + 1]
            + 2
            + 13 * signed
        )
        many += 1
    return many > 0


class TelemetryLog(Recording):
    """A telemetry log."""

    def needs(self) -> tuple[tuple[str, ...], str]:
        """Return what reading it takes."""
        return ("pymavlink", "fastcrc"), "mavlink"

    def streams(self) -> list[ImuStream]:
        """Messages of sensors that are in the log."""
        self._scan()
        if not self._found:
            raise InputError(
                f"{self.path}: has no IMU message; have the autopilot send HIGHRES_IMU"
                " or RAW_IMU, and record again"
            )
        says = "calibrated, body's frame; unit found by gravity"
        return [ImuStream(name, says) for name in sorted(self._found)]

    def notes(self, stream: str) -> dict[str, Any]:
        """Return unit, rounding, and what the autopilot had installed."""
        self._scan()
        system, component, message, sensor = self._found[stream]
        told = {
            "message": message,
            "vehicle": [system, component],
            "instance": sensor,
        }
        decoder = self._decoders.get(stream)
        if decoder is not None:
            told["acc_unit"] = decoder.acc_unit
            told["gyr_unit"] = decoder.gyr_unit
            told["thermometer"] = decoder.thermometer
            told["grain"] = asdict(decoder.grain)
        autopilot = self._autopilots.get((system, component), -1)
        wanted = [
            n for some in parameter_names(autopilot, sensor).values() for n in some
        ]
        params = self._params.get((system, component), {})
        values = {n: params[n] for n in wanted if n in params}
        table = (
            InstalledCalibration(autopilot, sensor, values).as_table()
            if values
            else None
        )
        return {**told, "installed": table}

    def blocks(self, stream: str) -> Iterator[Block]:
        """Samples of one message, a piece of the log at a time."""
        self._scan()
        decoder = self._decoders[stream] = self._decoder(stream)
        for chunks in self._chunks():
            try:
                block = decoder.feed_all(chunks)
            except DeviceError as error:
                raise InputError(f"{self.path}: {error}") from error
            decoder.other_messages.clear()
            if block is not None:
                yield block
        health = decoder.health
        if not health.samples:
            raise InputError(
                f"{self.path}: too few samples of {stream} to tell their unit; name it"
                ' with --options "acc_unit=mg"'
            )
        if health.bad or health.skipped:
            self.says.append(
                f"{health.skipped} bytes belong to no whole packet, {health.bad} "
                "packets failed their check"
            )
        if health.repeated:
            self.says.append(f"{health.repeated} repeated samples are left out")

    def _decoder(self, stream: str) -> MavlinkDecoder:
        from fieldcal.drivers.mavlink_samples import INSTANCES, MavlinkDecoder

        system, component, message, sensor = self._found[stream]
        fixed = {
            "message": message, "system": str(system), "component": str(component)
        }  # fmt: skip
        if message not in INSTANCES:
            fixed["instance"] = str(sensor)
        options = Options("options", self.wanted.options).with_fixed(**fixed)
        decoder = MavlinkDecoder(options)
        decoder.autopilots |= self._autopilots
        options.finish()
        return decoder

    def _chunks(self) -> Iterator[list[Chunk]]:
        """Packets with their arrivals, a piece of the log at a time."""
        rest = b""
        for piece in self.pieces(CUT):
            data = rest + piece
            chunks, at = split_whole_packets(data)
            rest = data[at:]
            yield chunks
        if rest:
            yield split_log(rest)

    _scanned = False

    def _scan(self) -> None:
        """Look through the log once: who sends what, and the parameters."""
        if self._scanned:
            return
        from fieldcal.drivers.mavlink_samples import (
            INSTANCES,
            MESSAGE_KINDS,
            MavlinkDecoder,
        )

        self._decoders: dict[str, MavlinkDecoder] = {}
        self._autopilots: dict[tuple[int, int], int] = {}
        self._params: dict[tuple[int, int], dict[str, float]] = {}
        listener = MavlinkDecoder(Options("options", "acc_unit=m/s^2"))
        by_number = {kind.identifier: name for name, kind in MESSAGE_KINDS.items()}
        found: set[tuple[int, int, str, int]] = set()
        for chunks in self._chunks():
            for chunk in chunks:
                data = chunk.data
                second = data[0] == VERSION_2
                number = int.from_bytes(data[7:10], "little") if second else data[5]
                if number in by_number:
                    name = by_number[number]
                    sensor = INSTANCES.get(name)
                    who = (data[5], data[6]) if second else (data[3], data[4])
                    if sensor is None:
                        sensor = _sensor(data, name)
                    found.add((*who, name, sensor))
            aside = [c for c in chunks if _number(c.data) in (0, 22)]
            listener.feed_all(aside)
            for message in listener.other_messages:
                self._hear(message)
            listener.other_messages.clear()
        several = len({(s, c) for s, c, *_ in found}) > 1
        self._found = {
            f"{s}.{c}.{name}.{n}" if several else f"{name}.{n}": (s, c, name, n)
            for s, c, name, n in found
        }
        self._scanned = True

    def _hear(self, message: Any) -> None:
        who = (message.get_srcSystem(), message.get_srcComponent())
        if message.get_type() == "HEARTBEAT":
            self._autopilots[who] = int(message.autopilot)
        elif message.get_type() == "PARAM_VALUE":
            value = float(message.param_value)
            if np.isfinite(value):
                self._params.setdefault(who, {})[str(message.param_id)] = value


def _number(data: bytes) -> int:
    if len(data) < 10:
        return -1
    return int.from_bytes(data[7:10], "little") if data[0] == VERSION_2 else data[5]


def _sensor(data: bytes, name: str) -> int:
    """Sensor that a message states; trailing zeros are optional."""
    from fieldcal.drivers.mavlink_samples import MESSAGE_KINDS

    head = HEADER_BYTES[data[0]]
    fields = MESSAGE_KINDS[name].layout.fields
    place = fields["id"][1] if fields else 0
    return data[head + place] if place < data[1] else 0
