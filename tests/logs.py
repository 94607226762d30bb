"""Logs of several formats with known samples, written apart from what reads them."""

from __future__ import annotations

import io
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.core.samples import Array, Block

SYNC = bytes([0x2F, 0x73, 0x13, 0x20, 0x25, 0x0C, 0xBB, 0x12])


def imu(seed: int, n: int = 400, rate: float = 100.0, start: float = 5.0) -> Block:
    """Samples at rest that can be told apart, times in whole microseconds."""
    rng = np.random.default_rng(seed)
    t = start + np.round(np.arange(n) / rate, 6)
    acc = np.array([0.1 * seed, 0.2, -9.8]) + 0.02 * rng.standard_normal((n, 3))
    gyr = 0.01 * seed + 1e-3 * rng.standard_normal((n, 3))
    degrees = _single(20 + seed + np.linspace(0, 1, n))
    return Block.of(t, _single(acc), _single(gyr), degrees)


def _single(values: Array) -> Array:
    """Round as logs do."""
    return values.astype(np.float32).astype(float)


def _message(kind: str, body: bytes) -> bytes:
    return struct.pack("<HB", len(body), ord(kind)) + body


def ulog(
    units: dict[int, Block],
    parameters: dict[str, float],
    combined: Block | None = None,
    late: float = 0.0,
) -> bytes:
    """A PX4 log; the gyroscopes' times are `late` s behind the accelerometers'."""
    three = "uint64_t timestamp;uint64_t timestamp_sample;uint32_t device_id;"
    out = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0) + _message("B", bytes(40))
    formats = [
        f"sensor_accel:{three}float x;float y;float z;float temperature;",
        f"sensor_gyro:{three}float x;float y;float z;float temperature;",
        "sensor_combined:uint64_t timestamp;float[3] gyro_rad;"
        "int32_t accelerometer_timestamp_relative;float[3] accelerometer_m_s2;",
        "noise:uint64_t timestamp;uint8_t[5] bytes;",
    ]
    out += b"".join(_message("F", text.encode()) for text in formats)
    for name, value in parameters.items():
        key = f"float {name}".encode()
        out += _message("P", bytes([len(key)]) + key + struct.pack("<f", value))
    names = {0: "noise", 30: "sensor_combined"}
    for unit in units:
        names |= {1 + unit: "sensor_accel", 11 + unit: "sensor_gyro"}
    for number, name in names.items():
        instance = (number - 1) % 10 if 0 < number < 30 else 0
        out += _message("A", struct.pack("<BH", instance, number) + name.encode())
    rows: list[tuple[float, bytes]] = []
    for unit, block in units.items():
        for i, t in enumerate(block.t.tolist()):
            for first, values, at in ((1, block.acc, t), (11, block.gyr, t + late)):
                stamp = round(at * 1e6)
                body = struct.pack("<HQQI", first + unit, stamp + 3, stamp, 100 + unit)
                body += struct.pack("<4f", *values[i], block.temperature[i])
                rows.append((at, _message("D", body)))
    for i, t in enumerate(combined.t.tolist() if combined else []):
        assert combined is not None
        relative = 0x7FFFFFFF if i % 50 == 7 else 0
        body = struct.pack("<HQ3fi", 30, round(t * 1e6), *combined.gyr[i], relative)
        rows.append((t, _message("D", body + struct.pack("<3f", *combined.acc[i]))))
    for k, (at, row) in enumerate(sorted(rows, key=lambda pair: pair[0])):
        out += row
        if k % 7 == 0:
            body = struct.pack("<HQ5B", 0, round(at * 1e6), 1, 2, 3, 4, 5)
            out += _message("D", body)
        if k % 100 == 0:
            out += _message("S", SYNC)
    return out


def dataflash(units: dict[int, Block], parameters: dict[str, float]) -> bytes:
    """An ArduPilot log with messages IMU and PARM."""
    forms = [
        (128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns"),
        (131, 52, "PARM", "QNff", "TimeUS,Name,Value,Default"),
        (132, 44, "IMU", "QBffffffffBB",
         "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,T,GH,AH"),
        (133, 13, "MODE", "QBB", "TimeUS,Mode,Rsn"),
    ]  # fmt: skip
    out = b""
    sizes = {"PARM": 3 + 8 + 16 + 8, "IMU": 3 + 8 + 1 + 32 + 2, "MODE": 13}
    for kind, size, name, letters, labels in forms:
        size = sizes.get(name, size)
        out += b"\xa3\x95\x80" + struct.pack(
            "<BB4s16s64s", kind, size, *(x.encode() for x in (name, letters, labels))
        )
    for name, value in parameters.items():
        body = struct.pack("<Q16sff", 1, name.encode(), value, 0.0)
        out += b"\xa3\x95\x83" + body
    rows = []
    for unit, block in units.items():
        for i, t in enumerate(block.t.tolist()):
            body = struct.pack(
                "<QB6f", round(t * 1e6), unit, *block.gyr[i], *block.acc[i]
            )
            body += struct.pack("<2fBB", 0.0, block.temperature[i], 1, 1)
            rows.append((t, b"\xa3\x95\x84" + body))
    for k, (t, row) in enumerate(sorted(rows, key=lambda pair: pair[0])):
        out += row
        if k % 9 == 0:
            out += b"\xa3\x95\x85" + struct.pack("<QBB", round(t * 1e6), 5, 1)
    return out


def tlog(units: dict[int, Block], parameters: dict[str, float]) -> bytes:
    """A telemetry log of HIGHRES_IMU of several sensors."""
    from pymavlink.dialects.v20 import all as dialect

    link: Any = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    out, host = io.BytesIO(), 1.7e15

    def put(message: Any, t: float) -> None:
        out.write(struct.pack(">Q", int(host + 1e6 * t)) + message.pack(link))
        link.seq = (link.seq + 1) % 256

    put(dialect.MAVLink_heartbeat_message(2, 3, 0, 0, 4, 3), 0.0)
    for name, value in parameters.items():
        put(
            dialect.MAVLink_param_value_message(
                name.encode(), value, 9, len(parameters), 0
            ),
            0.0,
        )
    rows = [
        (t, unit, i)
        for unit, block in units.items()
        for i, t in enumerate(block.t.tolist())
    ]
    for t, unit, i in sorted(rows):
        block = units[unit]
        put(
            dialect.MAVLink_highres_imu_message(
                round(t * 1e6), *block.acc[i], *block.gyr[i], 0, 0, 0, 0, 0, 0,
                block.temperature[i], 0xFFFF, unit,
            ),
            t,
        )  # fmt: skip
    return out.getvalue()


CAN_MAP = ",".join(
    [*(f"a{x}=Acceleration.A{x}" for x in "xyz"), *(f"g{x}=Rate.G{x}" for x in "xyz")]
)


def dbc() -> str:
    """Describe frames with three whole numbers each, m/s^2 / 1000 and rad/s / 10000."""
    lines = ['VERSION ""', "BS_:", "BU_: X"]
    for number, name, letter, unit, scale in (
        (16, "Acceleration", "A", "m/s^2", 1e-3),
        (17, "Rate", "G", "rad/s", 1e-4),
    ):
        lines.append(f"BO_ {number} {name}: 8 X")
        for i, axis in enumerate("xyz"):
            lines.append(
                f' SG_ {letter}{axis} : {16 * i}|16@1- ({scale},0) [0|0] "{unit}" X'
            )
        lines.append(' SG_ N : 48|8@1+ (1,0) [0|255] "" X')
    return "\n".join(lines) + "\n"


def can_log(path: Path, block: Block) -> None:
    """Write frames by python-can, which goes by the ending."""
    import can

    with can.Logger(str(path)) as log:
        for i, t in enumerate(block.t.tolist()):
            for number, values, scale in ((16, block.acc, 1e-3), (17, block.gyr, 1e-4)):
                whole = [round(x / scale) for x in values[i].tolist()]
                data = struct.pack("<3hBB", *whole, i % 256, 0)
                log.on_message_received(
                    can.Message(
                        timestamp=1.5e9 + t, arbitration_id=number, data=data,
                        is_extended_id=False, channel="can0",
                    )
                )  # fmt: skip


def table(block: Block) -> Array:
    """Columns t, ax … gz."""
    return np.column_stack([block.t, block.six])


Writer = Callable[[Path, Block], None]


def arrays(path: Path, block: Block) -> None:
    """Write a table by the ending."""
    rows = table(block)
    if path.suffix == ".npz":
        np.savez(path, imu=rows)
    elif path.suffix == ".npy":
        np.save(path, rows)
    elif path.suffix == ".mat":
        from scipy.io import savemat

        savemat(path, {"imu": rows})
    else:
        import h5py

        with h5py.File(path, "w", userblock_size=512) as file:
            file["group/imu"] = rows.T
        with path.open("r+b") as raw:
            raw.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
