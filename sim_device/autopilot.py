"""An autopilot as seen over MAVLink: it answers, and sends what it is asked to send.

It has a calibration of its own among its parameters, and applies it, axis by axis:
U = (r - o) k. Options follow the place as a query: ``autopilot`` (ardupilot, px4),
``system``, ``instance``, ``streams`` (messages that it sends unasked, joined by
commas), ``deny=1`` (no SET_MESSAGE_INTERVAL), ``acc_unit`` (mg, mm/s^2), ``mute=1`` (no
parameter is answered), and any parameter by its name. ``drop`` names parameters, joined
by commas, that it does not take; ``alter`` some that it answers rightly and keeps
wrongly; ``glitch`` the same, but the first time only.

With ``INS_GYR_CAL=1``, as ArduPilot has it, it calibrates its gyroscopes when it starts
anew: after `BOOT_S` s of samples INS_GYROFFS is their mean.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from typing import Any
from urllib.parse import parse_qsl

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block
from fieldcal.sim_device import autopilot_thermal
from fieldcal.sim_device.mavlink_packing import (
    ACC_UNITS,
    HIGHRES,
    RAW,
    SCALED,
    messages,
)

STREAMS = {
    "HIGHRES_IMU": HIGHRES,
    "RAW_IMU": RAW,
    **dict(zip(("SCALED_IMU", "SCALED_IMU2", "SCALED_IMU3"), SCALED, strict=True)),
}
RAW_SENSORS = (RAW, *SCALED[1:])
"""What the old request for the raw sensor stream begins."""

KINDS = {"ardupilot": 3, "px4": 12}
FAULTS = ("drop", "alter", "glitch")
OWN = (
    *("autopilot", "system", "instance", "streams", "deny", "acc_unit", "mute"),
    *FAULTS,
)
DENIED, UNSUPPORTED = 2, 3
INT32, REAL32 = 6, 9
WHOLE = ("SENS_BOARD_ROT", *autopilot_thermal.WHOLE)
"""Parameters of PX4 that are whole numbers."""

COPTER = 2

BOOT_S = 2.0
"""How long it averages its gyroscopes when it starts anew, s of device time."""

SET_INTERVAL = 511


def parameters(kind: str) -> dict[str, float]:
    """Parameters of an autopilot fresh from the shop."""
    if kind == "px4":
        acc = {f"CAL_ACC{n}_{x}OFF": 0.0 for n in range(3) for x in "XYZ"}
        scale = {f"CAL_ACC{n}_{x}SCALE": 1.0 for n in range(3) for x in "XYZ"}
        gyr = {f"CAL_GYRO{n}_{x}OFF": 0.0 for n in range(3) for x in "XYZ"}
        cutoffs = {"IMU_ACCEL_CUTOFF": 30.0, "IMU_GYRO_CUTOFF": 40.0}
        thermal = autopilot_thermal.parameters(kind)
        return {**acc, **scale, **gyr, **cutoffs, "SENS_BOARD_ROT": 0.0, **thermal}
    table = {}
    for n in ("", "2", "3"):
        for x in "XYZ":
            table[f"INS_ACC{n}OFFS_{x}"] = 0.0
            table[f"INS_ACC{n}SCAL_{x}"] = 1.0
            table[f"INS_GYR{n}OFFS_{x}"] = 0.0
    filters = {"INS_ACCEL_FILTER": 20.0, "INS_GYRO_FILTER": 20.0}
    thermal = autopilot_thermal.parameters(kind)
    board = {"AHRS_ORIENTATION": 0.0, "INS_GYR_CAL": 1.0}
    return {**table, **filters, **thermal, **board}


class Autopilot:
    """Simulated autopilot on a MAVLink link.

    Parameters
    ----------
    query : options of the address

    Raises
    ------
    InputError
        If there is no such option, parameter or message.

    """

    def __init__(self, query: str = "") -> None:
        from pymavlink.dialects.v20 import all as dialect

        given = _options(query)
        self._kind = given.get("autopilot", "ardupilot")
        if self._kind not in KINDS:
            raise InputError(f"autopilot={self._kind!r} is none of {', '.join(KINDS)}")
        self._instance = int(_number(given, "instance", 0, 2))
        self._deny, self._mute = given.get("deny") == "1", given.get("mute") == "1"
        self._unit = given.get("acc_unit", "mg")
        if self._unit not in ACC_UNITS:
            raise InputError(
                f"acc_unit={self._unit!r} is none of {', '.join(ACC_UNITS)}"
            )
        self.parameters = {**parameters(self._kind), **_parameters(given, self._kind)}
        self._wrong = {f: given.get(f, "").split(",") for f in FAULTS}
        self._dialect = dialect
        system = int(_number(given, "system", 1, 255))
        self._mav = dialect.MAVLink(None, system, 1)
        self._mav.robust_parsing = True
        self._target = (system, 1)
        self._unasked: dict[int, float] = {}
        for name in filter(None, given.get("streams", "").split(",")):
            if name not in STREAMS:
                raise InputError(f"streams={name!r} is none of {', '.join(STREAMS)}")
            self._unasked[STREAMS[name]] = 0.0
        self._every = dict(self._unasked)
        self._booting: list[Block] = []
        self._boots = False

    @property
    def sends(self) -> bool:
        """Whether it was asked for any samples."""
        return bool(self._every)

    def reboot(self) -> None:
        """Send only what is sent unasked; parameters outlast it, but what it measures.

        That it measures its gyroscopes at each start is ArduPilot's INS_GYR_CAL.
        """
        self._every = dict(self._unasked)
        self._booting, self._boots = [], bool(self.parameters.get("INS_GYR_CAL"))

    def heartbeat(self) -> bytes:
        """Say that it is there."""
        kind = KINDS[self._kind]
        return self._packed(self._mav.heartbeat_encode(COPTER, kind, 81, 0, 3))

    def samples(self, block: Block, rate: float) -> list[bytes]:
        """Put samples into packets, of all messages that are asked for.

        Parameters
        ----------
        block : what the sensor puts out
        rate : of the sensor, Hz

        """
        self._calibrate(block)
        block = self._corrected(block)
        packets: list[bytes] = []
        for number, interval in self._every.items():
            step = max(1, round(interval * rate))
            due = block.seq.astype(int) % step == 0
            some = Block.of(
                block.t[due],
                block.acc[due],
                block.gyr[due],
                block.temperature[due],
                block.seq[due],
            )
            made = messages(self._dialect, number, some, self._unit, self._instance)
            packets += map(self._packed, made)
        return packets

    def hear(self, data: bytes) -> bytes:
        """Answer bytes of the host."""
        heard = self._mav.parse_buffer(data) or []
        return b"".join(self._answer(message) for message in heard)

    def _calibrate(self, block: Block) -> None:
        """Take the gyroscopes' mean as their offset, once it has booted."""
        if not self._boots:
            return
        self._booting.append(block)
        if block.t[-1] - self._booting[0].t[0] >= BOOT_S:
            mean = np.concatenate([some.gyr for some in self._booting]).mean(axis=0)
            self.parameters |= dict(zip(self._names("gyr", "off"), mean, strict=True))
            warm = np.concatenate([some.temperature for some in self._booting]).mean()
            self.parameters[f"INS_GYR{self._instance + 1}_CALTEMP"] = float(warm)
            self._boots = False

    def _corrected(self, block: Block) -> Block:
        """Apply the calibration that it has."""
        warm = autopilot_thermal.thermal_correction(
            self._kind, self._instance, self.parameters, block
        )
        acc, gyr = block.acc - warm[0], block.gyr - warm[1]
        acc = (acc - self._triad("acc", "off")) * self._triad("acc", "scale")
        gyr = gyr - self._triad("gyr", "off")
        return Block.of(block.t, acc, gyr, block.temperature, block.seq)

    def _triad(self, sensor: str, what: str) -> Array:
        return np.array([self.parameters[n] for n in self._names(sensor, what)])

    def _names(self, sensor: str, what: str) -> list[str]:
        n = self._instance
        if self._kind == "px4":
            name = f"CAL_{'ACC' if sensor == 'acc' else 'GYRO'}{n}_{{}}{what.upper()}"
        else:
            number, word = n + 1 if n else "", {"off": "OFFS", "scale": "SCAL"}[what]
            name = f"INS_{sensor.upper()}{number}{word}_{{}}"
        return [name.format(axis) for axis in "XYZ"]

    def _answer(self, message: Any) -> bytes:
        kind = message.get_type()
        if kind == "COMMAND_LONG" and self._is_target(message):
            result = self._command(message)
            return self._packed(self._mav.command_ack_encode(message.command, result))
        if kind == "REQUEST_DATA_STREAM" and self._is_target(message):
            rate = message.req_message_rate
            if message.start_stop and rate:
                self._every |= dict.fromkeys(RAW_SENSORS, 1 / rate)
        elif kind == "PARAM_REQUEST_READ" and self._is_target(message):
            return self._value(message.param_id)
        elif kind == "PARAM_SET" and self._is_target(message):
            return self._set(message.param_id, self._told(message))
        return b""

    def _told(self, message: Any) -> float | None:
        """A parameter's value as it was sent; PX4 takes none of another type."""
        value = float(message.param_value)
        if self._kind != "px4":
            return value
        is_whole = message.param_id in WHOLE
        if message.param_type != (INT32 if is_whole else REAL32):
            return None
        (bits,) = struct.unpack("<i", struct.pack("<f", value))
        return float(bits) if is_whole else value

    def _set(self, name: str, value: float | None) -> bytes:
        """Set a parameter, or do something else with it, and answer."""
        wrong = self._wrong
        if value is None or name not in self.parameters or name in wrong["drop"]:
            return self._value(name)
        self.parameters[name] = value
        answer = self._value(name)
        if name in (*wrong["alter"], *wrong["glitch"]):
            self.parameters[name] = 1.01 * value + 0.01
        wrong["glitch"] = [n for n in wrong["glitch"] if n != name]
        return answer

    def _is_target(self, message: Any) -> bool:
        system, component = message.target_system, message.target_component
        return system in (0, self._target[0]) and component in (0, self._target[1])

    def _command(self, message: Any) -> int:
        if message.command != SET_INTERVAL:
            return UNSUPPORTED
        number, interval = int(message.param1), float(message.param2)
        if self._deny or number not in STREAMS.values() or not math.isfinite(interval):
            return DENIED
        if interval < 0:
            self._every.pop(number, None)
        else:
            self._every[number] = interval / 1e6
        return 0

    def _value(self, name: str) -> bytes:
        if self._mute or name not in self.parameters:
            return b""
        value, kind = self.parameters[name], REAL32
        if self._kind == "px4" and name in WHOLE:
            # PX4 puts the bits of a whole number where a float belongs
            (value,), kind = struct.unpack("<f", struct.pack("<i", int(value))), INT32
        index = list(self.parameters).index(name)
        return self._packed(
            self._mav.param_value_encode(
                name.encode(), value, kind, len(self.parameters), index
            )
        )

    def _packed(self, message: Any) -> bytes:
        packed: bytes = message.pack(self._mav)
        self._mav.seq = (self._mav.seq + 1) % 256
        return packed


def _options(query: str) -> dict[str, str]:
    try:
        return dict(parse_qsl(query, strict_parsing=bool(query)))
    except ValueError as error:
        raise InputError(
            f"{query!r}: options are like name=value&name=value"
        ) from error


def _parameters(given: Mapping[str, str], kind: str) -> dict[str, float]:
    """Parameters among the options."""
    known, found = parameters(kind), {}
    for name in given:
        if name in OWN:
            continue
        if name not in known:
            raise InputError(
                f"no option or parameter {name!r}; options are {', '.join(OWN)}"
            )
        found[name] = _number(given, name, 0.0)
    return found


def _number(
    given: Mapping[str, str], name: str, default: float, most: float = 1e9
) -> float:
    try:
        value = float(given.get(name, default))
    except ValueError:
        value = math.nan
    if not abs(value) <= most:
        raise InputError(f"{name}={given[name]!r} must be a number up to {most:g}")
    return value
