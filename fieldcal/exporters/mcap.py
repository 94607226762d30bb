"""MCAP with ROS 2 messages, for Foxglove, PlotJuggler, rerun.

Topics: ``/imu/raw`` as recorded, ``/imu/calibrated`` with the calibration taken out,
f = M^-1 (U - bias) (raw -> true), both sensor_msgs/msg/Imu in m/s^2 and rad/s, device
axes; ``/imu/temperature`` in deg C. Stamps are the device's time. What was not measured
says so by -1 in its covariance, as the message's definition has it.
"""

from __future__ import annotations

import os
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.core.errors import InputError, disk_says
from fieldcal.core.samples import Block
from fieldcal.exporters import ExportSource

WHAT = "MCAP, raw and calibrated samples, for Foxglove and PlotJuggler"
ENDING = ".mcap"

FRAME = "imu"

LAST_STAMP = 2.0**31
"""Time that a message's stamp no longer holds, s."""

_HEADER = "std_msgs/Header header\n"
_THREE = "geometry_msgs/Vector3"
_PARTS = {
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec",
}
_VECTORS = {
    "geometry_msgs/Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w",
    _THREE: "float64 x\nfloat64 y\nfloat64 z",
}
_IMU = (
    f"{_HEADER}geometry_msgs/Quaternion orientation\n"
    "float64[9] orientation_covariance\n"
    f"{_THREE} angular_velocity\nfloat64[9] angular_velocity_covariance\n"
    f"{_THREE} linear_acceleration\nfloat64[9] linear_acceleration_covariance"
)
_TEMPERATURE = f"{_HEADER}float64 temperature\nfloat64 variance"

_UNKNOWN = [-1.0] + [0.0] * 8
_NO_COVARIANCE = [0.0] * 9


def _message_definition(text: str, parts: dict[str, str]) -> str:
    """Definition of a message followed by those of its parts, in MCAP's form."""
    rule = "\n" + "=" * 80 + "\n"
    return text + "".join(f"{rule}MSG: {n}\n{body}" for n, body in parts.items())


def write(source: ExportSource, path: Path) -> list[str]:
    """Write the file; what the user must know.

    Raises
    ------
    InputError
        If what writes it is not installed, a time is too large for a stamp, or the file
        cannot be written.

    """
    if not all(find_spec(module) for module in ("mcap", "mcap_ros2")):
        raise InputError(
            "MCAP needs mcap and mcap-ros2-support: pip install 'fieldcal[mcap]'"
        )
    from mcap_ros2.writer import Writer

    raw = source.session.block
    calibrated = source.calibration.apply(raw, source.nominal)
    shift = max(0.0, -float(raw.t[0]))
    if not (last := float(raw.t[-1]) + shift) < LAST_STAMP:
        raise InputError(
            f"the session's times reach {last:.3g} s, and a stamp of ROS ends at"
            f" {LAST_STAMP:.3g} s: record or import it again with the unit of its time"
        )
    part = path.with_name(f".{path.name}.part")
    try:
        with part.open("wb") as file:
            writer: Any = Writer(file)
            imu = writer.register_msgdef(
                "sensor_msgs/msg/Imu", _message_definition(_IMU, _VECTORS | _PARTS)
            )
            degrees = writer.register_msgdef(
                "sensor_msgs/msg/Temperature", _message_definition(_TEMPERATURE, _PARTS)
            )
            for i, t in enumerate((raw.t + shift).tolist()):
                if np.isfinite(raw.temperature[i]):
                    said = {
                        "header": _header(t),
                        "temperature": float(raw.temperature[i]),
                        "variance": 0.0,
                    }
                    _write_message(writer, degrees, "/imu/temperature", t, said)
                _write_sample(writer, imu, "/imu/raw", t, raw, i)
                _write_sample(writer, imu, "/imu/calibrated", t, calibrated, i)
            writer.finish()
        os.replace(part, path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {disk_says(error)}") from error
    finally:
        with suppress(OSError):  # a disk that is read-only, or gone
            part.unlink(missing_ok=True)
    moved = [f"times begin {shift:g} s later: MCAP has none before 0"] * (shift > 0)
    return [*source.matrix_notices, *moved]


def _header(t: float) -> dict[str, Any]:
    whole, nano = divmod(round(t * 1e9), 10**9)
    return {"stamp": {"sec": whole, "nanosec": nano}, "frame_id": FRAME}


def _write_sample(
    writer: Any, schema: Any, topic: str, t: float, block: Block, i: int
) -> None:
    acc, gyr = block.acc[i].tolist(), block.gyr[i].tolist()
    known = [np.isfinite(three).all() for three in (acc, gyr)]
    said = {
        "header": _header(t),
        "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
        "orientation_covariance": _UNKNOWN,
        "angular_velocity": dict(zip("xyz", gyr, strict=True)),
        "angular_velocity_covariance": _NO_COVARIANCE if known[1] else _UNKNOWN,
        "linear_acceleration": dict(zip("xyz", acc, strict=True)),
        "linear_acceleration_covariance": _NO_COVARIANCE if known[0] else _UNKNOWN,
    }
    _write_message(writer, schema, topic, t, said)


def _write_message(
    writer: Any, schema: Any, topic: str, t: float, said: dict[str, Any]
) -> None:
    stamp = round(t * 1e9)
    writer.write_message(
        topic=topic, schema=schema, message=said, log_time=stamp, publish_time=stamp
    )
