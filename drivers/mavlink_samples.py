"""Samples out of MAVLink's IMU messages, and the other messages that matter.

Bytes in, blocks out, no I/O and no clock. A vehicle is a system and a component; of
those that send the message, the first is taken unless one was chosen. Units are told
from the first samples, which wait until they are, see `mavlink_units`.

The temperature of RAW_IMU and SCALED_IMU is the sensor's. That of HIGHRES_IMU is the
barometer's in the programs of `BAROMETER_AUTOPILOTS`, and says nothing of the sensor.
PX4 takes the biases that its filter estimates out of HIGHRES_IMU, and of no other.
Source: GCS_Common.cpp of ArduPilot, HIGHRES_IMU.hpp and SCALED_IMU.hpp of PX4.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array, Block, Grain, concat
from fieldcal.drivers.codec import Codec
from fieldcal.drivers.framing import Bytes, FrameCandidates, FrameScan, as_doubles
from fieldcal.drivers.mavlink_frames import (
    LONGEST_PACKET,
    PacketHeaders,
    packet_candidates,
    padded_payloads,
    read_headers,
)
from fieldcal.drivers.mavlink_parameter_names import ARDUPILOT, PX4
from fieldcal.drivers.mavlink_units import (
    ACCELERATIONS,
    RATES,
    recognise_unit,
    unit_error,
    untruncated_mean,
)
from fieldcal.drivers.options import Options
from fieldcal.drivers.stamp_timebase import StampTimebase

Fields = NDArray[np.void]

_SIX, _FIELD = ["acc", "gyr", "mag"], "(3,)<i2"
_SCALED = np.dtype([("t", "<u4"), *((n, _FIELD) for n in _SIX), ("temperature", "<i2")])
_RAW = np.dtype(
    [("t", "<u8"), *((n, _FIELD) for n in _SIX), ("id", "u1"), ("temperature", "<i2")]
)
_HIGHRES = np.dtype(
    [("t", "<u8"), *((n, "(3,)<f4") for n in _SIX), ("pressures", "(3,)<f4")]
    + [("temperature", "<f4"), ("updated", "<u2"), ("id", "u1")]
)


class MessageKind(NamedTuple):
    """A message: its number, fields, tick of its time in s, whether in integers."""

    identifier: int
    layout: np.dtype[Any]
    tick: float
    whole: bool


MESSAGE_KINDS = {
    "HIGHRES_IMU": MessageKind(105, _HIGHRES, 1e-6, False),
    "RAW_IMU": MessageKind(27, _RAW, 1e-6, True),
    "SCALED_IMU": MessageKind(26, _SCALED, 1e-3, True),
    "SCALED_IMU2": MessageKind(116, _SCALED, 1e-3, True),
    "SCALED_IMU3": MessageKind(129, _SCALED, 1e-3, True),
}
INSTANCES = {"SCALED_IMU": 0, "SCALED_IMU2": 1, "SCALED_IMU3": 2}
"""Which sensor a message speaks of that has no field for it."""

OTHER_MESSAGES = (0, 22, 77)
"""Heartbeats, values of parameters, answers to commands."""

MOST_OTHER_MESSAGES = 1000
"""Such messages kept until they are asked for."""

UNIT_SAMPLES, MOST_UNIT_SAMPLES = 16, 160
"""Samples that tell the unit, and after which it is given up."""

BAROMETER_AUTOPILOTS = (ARDUPILOT, PX4)
"""Programs whose HIGHRES_IMU has the temperature of the barometer."""

ACC_UPDATED, GYR_UPDATED, TEMPERATURE_UPDATED = 0o7, 0o70, 1 << 12
"""Bits of HIGHRES_IMU's fields_updated."""


class MavlinkDecoder(Codec):
    """A decoder of one message of one vehicle.

    Attributes
    ----------
    other_messages : messages besides the samples, as pymavlink makes them
    sources : system and component of all that send the message
    messages_heard : names of the IMU messages that came, chosen or not
    acc_unit : unit of acceleration in the message; empty until it is known
    autopilots : numbers of the programs that sent a heartbeat, by system and component

    """

    longest = LONGEST_PACKET

    def __init__(self, options: Options) -> None:
        from pymavlink.dialects.v20 import all as dialect

        super().__init__(options)
        self.message = options.choice("message", tuple(MESSAGE_KINDS), "HIGHRES_IMU")
        self.kind = MESSAGE_KINDS[self.message]
        self._system = int(options.number("system", 0, 0, 255))
        self._component = int(options.number("component", 0, 0, 255))
        self.instance = INSTANCES.get(self.message, 0)
        if self.message not in INSTANCES:
            self.instance = int(options.number("instance", 0, 0, 255))
        self.acc_unit = options.choice("acc_unit", ("", *ACCELERATIONS), "")
        usual = "mrad/s" if self.kind.whole else "rad/s"
        self.gyr_unit = options.choice("gyr_unit", tuple(RATES), usual)
        self._cut = options.choice("rounding", ("cut", "nearest"), "cut") == "cut"
        self.other_messages: list[Any] = []
        self.sources: set[tuple[int, int]] = set()
        self.messages_heard: set[str] = set()
        self.autopilots: dict[tuple[int, int], int] = {}
        self._vehicle: tuple[int, int] | None = None
        self._waiting: list[tuple[Fields, Array]] = []
        span = 2.0**32 * self.kind.tick if self.kind.tick > 1e-6 else float("inf")
        resolution = self.kind.tick if self.kind.tick > 1e-6 else 0.0
        self._clock = StampTimebase(self.health, resolution, span, since_power_on=True)
        self._parser = dialect.MAVLink(None)
        self._broken = dialect.MAVError
        self._extras = np.full(max(dialect.mavlink_map) + 2, -1)
        for number, message in dialect.mavlink_map.items():
            self._extras[number] = message.crc_extra

    @property
    def grain(self) -> Grain:
        """What the message rounds to, once its unit is known."""
        if not self.kind.whole or not self.acc_unit:
            return Grain()
        return Grain(ACCELERATIONS[self.acc_unit], RATES[self.gyr_unit], self._cut)

    @property
    def vehicle(self) -> tuple[int, int] | None:
        """System and component whose samples are taken, once that is known."""
        return self._vehicle

    @property
    def thermometer(self) -> str:
        """Whose temperature the message has: ``imu``, ``barometer``, or empty."""
        if self.kind.whole:
            return "imu"
        return "barometer" if self._program in BAROMETER_AUTOPILOTS else ""

    @property
    def lacks_filter_bias(self) -> bool:
        """Whether the biases that the autopilot's filter estimates are taken out."""
        return self.message == "HIGHRES_IMU" and self._program == PX4

    @property
    def _program(self) -> int | None:
        """Number of the vehicle's program, once a heartbeat told it."""
        return self.autopilots.get(self._vehicle or (0, 0))

    def accepts(self, system: int, component: int) -> bool:
        """Whether the options allow this one."""
        return self._system in (0, system) and self._component in (0, component)

    def choose_vehicle(self, system: int, component: int) -> None:
        """Take the samples of this one, if none was taken so far."""
        self._vehicle = self._vehicle or (system, component)

    def drop_waiting(self) -> None:
        """Forget the samples that wait for their unit."""
        self._waiting = []

    def scan(self, data: Bytes) -> FrameCandidates:
        """Say where packets may begin."""
        return packet_candidates(data, self._extras)

    def decode(self, data: Bytes, found: FrameScan, t_host: Array) -> Block | None:
        """Make samples of whole packets, and keep the others that matter."""
        whole = read_headers(data, found)
        self._put_aside(data, whole)
        for name, kind in MESSAGE_KINDS.items():
            if name not in self.messages_heard and np.any(
                whole.identifiers == kind.identifier
            ):
                self.messages_heard.add(name)
        of = np.flatnonzero(whole.identifiers == self.kind.identifier)
        if not len(of):
            return None
        mine = of[self._chosen(whole.take(of))]
        size = self.kind.layout.itemsize
        bodies = padded_payloads(data, whole.take(mine), size)
        fields = np.ascontiguousarray(bodies).view(self.kind.layout)[:, 0]
        keep = self._fresh(fields)
        return self._in_units(fields[keep], t_host[mine[keep]])

    def _put_aside(self, data: Bytes, whole: PacketHeaders) -> None:
        for i in np.flatnonzero(np.isin(whole.identifiers, OTHER_MESSAGES)).tolist():
            text = bytearray(data[whole.starts[i] : whole.ends[i]].tobytes())
            try:
                message = self._parser.decode(text)
            except self._broken:
                self.health.bad += 1
                continue
            self.other_messages.append(message)
            if message.get_type() == "HEARTBEAT":
                who = (message.get_srcSystem(), message.get_srcComponent())
                self.autopilots[who] = int(message.autopilot)
        del self.other_messages[:-MOST_OTHER_MESSAGES]

    def _chosen(self, some: PacketHeaders) -> NDArray[np.bool_]:
        """Which packets are the vehicle's."""
        pairs = list(zip(some.systems.tolist(), some.components.tolist(), strict=True))
        allowed = [pair for pair in pairs if self.accepts(*pair)]
        self.sources.update(allowed)
        if allowed:
            self.choose_vehicle(*allowed[0])
        return np.array([pair == self._vehicle for pair in pairs])

    def _fresh(self, fields: Fields) -> NDArray[np.bool_]:
        """Leave out other sensors, and messages that only say the last values again."""
        names = fields.dtype.names or ()
        keep = np.ones(len(fields), dtype=bool)
        if "id" in names:
            keep &= fields["id"] == self.instance
        if "updated" in names:
            said = fields["updated"]
            old = keep & (said != 0) & (said & (ACC_UPDATED | GYR_UPDATED) == 0)
            self.health.repeated += int(np.count_nonzero(old))
            keep &= ~old
        return keep

    def _in_units(self, fields: Fields, t_host: Array) -> Block | None:
        if self.acc_unit:
            return self._block(fields, t_host)
        self._waiting.append((fields, t_host))
        fields = np.concatenate([some for some, _ in self._waiting])
        t_host = np.concatenate([some for _, some in self._waiting])
        acc = as_doubles(fields["acc"])
        for end in range(
            UNIT_SAMPLES, min(len(acc), MOST_UNIT_SAMPLES) + 1, UNIT_SAMPLES
        ):
            if unit := recognise_unit(acc[end - UNIT_SAMPLES : end], self.kind.whole):
                self.acc_unit, self._waiting = unit, []
                return self._block(fields, t_host)
        if len(acc) >= MOST_UNIT_SAMPLES:
            raise unit_error(acc[:MOST_UNIT_SAMPLES], self.kind.whole, self.message)
        return None

    def _block(self, fields: Fields, t_host: Array) -> Block | None:
        if not len(fields):
            return None
        acc, gyr = as_doubles(fields["acc"]), as_doubles(fields["gyr"])
        if self.kind.whole and self._cut:
            acc, gyr = untruncated_mean(acc), untruncated_mean(gyr)
        stamps = fields["t"] * self.kind.tick
        t = self._clock.times(stamps, np.ones(len(stamps)), t_host)
        new = ~np.isnan(t)
        block = Block.of(
            t,
            acc * ACCELERATIONS[self.acc_unit],
            gyr * RATES[self.gyr_unit],
            self._temperature(fields),
            None,
            t_host,
        )
        if new.all():
            return block
        cuts = [block[i : i + 1] for i in np.flatnonzero(new).tolist()]
        return concat(cuts) if cuts else None

    def _temperature(self, fields: Fields) -> Array:
        """Temperature of the sensor in deg C; nan where the message has none."""
        degrees = as_doubles(fields["temperature"])
        if self.thermometer == "barometer":
            return np.full(len(degrees), np.nan)
        if self.kind.whole:
            return np.where(degrees == 0, np.nan, degrees / 100)
        said = fields["updated"]
        given = (said == 0) | (said & TEMPERATURE_UPDATED > 0)
        return np.where(given, degrees, np.nan)
