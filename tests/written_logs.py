"""Logs as people and their programs write them, of one recording."""

from __future__ import annotations

import json
from collections.abc import Callable
from datetime import datetime, timedelta
from functools import reduce
from operator import xor
from pathlib import Path

import numpy as np
from laid_about import G, turned

from fieldcal.cli import main
from fieldcal.core.samples import Array, Block
from fieldcal.session.folder import Session

ROWS = turned(5, 50.0, 1.2, sides=7)


T, A, W = ROWS[:, 0], ROWS[:, 1:4], ROWS[:, 4:]


DEG, UP = np.rad2deg(W), A / np.linalg.norm(A, axis=1)[:, None]


BEGAN = datetime(2024, 5, 3, 14, 20, 31)


UNIX = 1714746031


Writer = Callable[[], str]


def lines(*columns: Array | list[str], sep: str = ",", head: str = "") -> str:
    """Columns (n,) or (n, k) as text."""
    cells = [c if isinstance(c, list) else [sep.join(f"{x:.10g}" for x in row)
             for row in np.reshape(c, (len(c), -1))] for c in columns]  # fmt: skip
    return "\n".join(
        ([head] if head else []) + [sep.join(r) for r in zip(*cells, strict=True)]
    )


def each(text: str, *columns: Array) -> str:
    """A text for each row, with its numbers."""
    return "\n".join(text.format(*row) for row in np.column_stack(columns).tolist())


def mixed() -> str:
    found = []
    for i, row in enumerate(ROWS.tolist()):
        found.append("IMU," + ",".join(f"{x:.8g}" for x in row))
        found += [f"GPS,{row[0]:.2f},48.1234,11.5678,512.3,8"] if i % 9 == 0 else []
    return "\n".join(found)


def in_turn() -> str:
    found = ["# sensors: ACCE;t(s);Acc_X(m/s^2);Acc_Y(m/s^2);Acc_Z(m/s^2);3",
             "% GYRO;t(s);Gyr_X(rad/s);Gyr_Y(rad/s);Gyr_Z(rad/s);3"]  # fmt: skip
    for t, a, w in zip(T + 7, A, W, strict=True):
        found.append(f"ACCE;{t:.4f};" + ";".join(f"{x:.8g}" for x in a) + ";3")
        found.append(f"GYRO;{t + 1e-3:.4f};" + ";".join(f"{x:.8g}" for x in w) + ";3")
    return "\n".join(found)


def echoed() -> str:
    parts = {"angular_velocity": W, "linear_acceleration": A}
    found = []
    for i, t in enumerate(T.tolist()):
        found += ["header:", f"  seq: {i}", "  stamp:", f"    secs: {UNIX + int(t)}",
                  f"    nsecs: {round(t % 1 * 1e9)}", '  frame_id: "imu"']  # fmt: skip
        for name, three in parts.items():
            values = zip("xyz", three[i], strict=True)
            found += [f"{name}:", *(f"  {axis}: {x:.9g}" for axis, x in values)]
        found += ["linear_acceleration_covariance: [0.0, 0.0, 0.0]", "---"]
    return "\n".join(found)


def checked() -> str:
    bare = lines(["PIMU"] * len(T), T, A, W).split("\n")
    return "\n".join(f"${b}*{reduce(xor, b.encode(), 0):02X}" for b in bare)


def vectornav() -> str:
    """Behind the time at which they came, with angles and a field before the force."""
    field = ["+012.000", "-001.000", "+003.000", "+00.2000", "+00.1000", "-00.4000"]
    bare = lines([",".join(["VNYMR", *field])] * len(T), A, W).split("\n")
    sums = [reduce(xor, b.encode(), 0) for b in bare]
    return "\n".join(
        f"{UNIX + t:.3f},${b}*{x:02X}" for t, b, x in zip(T, bare, sums, strict=True)
    )


def hexadecimal() -> str:
    counts = np.round(np.hstack([A * 16384 / G, DEG * 131.072])).astype(int) & 0xFFFF
    rows = [",".join(f"{x:04X}" for x in row) for row in counts]
    return lines(T * 1e3, rows, head="ms,ax,ay,az,gx,gy,gz")


def hexadecimal_of_c() -> str:
    """As ``%04X`` writes numbers of 32 bits, below lines of comment."""
    counts = np.round(np.hstack([A * 2048 / G, DEG * 16.384])).astype(int)
    rows = [",".join(f"{x & 0xFFFFFFFF:04X}" for x in row) + " " for row in counts]
    return "\n".join(["// Sample rate: 50.0Hz", "// Scenario: 4", SIX, *rows])


def described() -> str:
    """Lines of several kinds, of which others say the names and units."""
    found = ["$FLYS,1", "$VAR,FIRMWARE_VER,v1", "$COL,BARO,time,pressure",
             "$UNIT,BARO,s,Pa", "$COL,IMU,time,wx,wy,wz,ax,ay,az",
             "$UNIT,IMU,s,deg/s,deg/s,deg/s,g,g,g", "$DATA"]  # fmt: skip
    for i, (t, a, w) in enumerate(zip(T, A / G, DEG, strict=True)):
        found += [f"$BARO,{t + 0.002:.3f},1013{i:.2f}"] if i % 10 == 0 else []
        found.append(f"$IMU,{t:.3f}," + ",".join(f"{x:.9g}" for x in (*w, *a)))
    return "\n".join(found)


def scaled() -> str:
    """Counts below their scales, which are none of a usual full scale."""
    counts = np.round(np.hstack([W / 1.1e-4, A / G / 3.3e-4])).astype(int)
    rows = [f"{round(t * 1e4)}," + ",".join(map(str, row))
            for t, row in zip(T.tolist(), counts.tolist(), strict=True)]  # fmt: skip
    head = ["LOG", "version,1.1", "orientation,YxZ", "tscale,0.0001", "gscale,1.1e-4",
            "ascale,0.00033", "t,gx,gy,gz,ax,ay,az"]  # fmt: skip
    return "\n".join([*head, *rows])


def behind_brackets() -> str:
    found = []
    for t, a, w in zip(T.tolist(), A.tolist(), W.tolist(), strict=True):
        said = {f"{k}.{x}": v for k, three in (("acc", a), ("gyro", w))
                for x, v in zip("xyz", three, strict=True)}  # fmt: skip
        found.append(f"[{UNIX + t:.6f}][{134537 + round(1e3 * t)}][IMU]: {said}")
    return "\n".join(found)


def again() -> str:
    rows, names = lines(ROWS).split("\n"), "t,ax,ay,az,gx,gy,gz"
    return "\n".join(["ready", *rows[:3], names, *rows[3:300], names, *rows[300:]])


def started_twice() -> str:
    rows, says = lines(ROWS).split("\n"), "MPU6050 connected, 2 retries"
    names = f"t,{SIX}"
    return "\n".join([says, names, *rows[:300], "boot ok", says, names, *rows[300:]])


def topics() -> str:
    """Messages as a listener prints them, behind their topic and behind a time."""
    found = []
    for c, a, w in zip(clock("%H:%M:%S.%f"), A.tolist(), W.tolist(), strict=True):
        said = {"acc": dict(zip("xyz", a, strict=True)), "gyro": w}
        found.append(f"{c} -> {json.dumps(said)}")
    return "\n".join(found)


def merged_by_time() -> str:
    """Two sensors in one table, each with times of its own."""
    found = [f"time,{SIX}"]
    for t, a, w in zip(T, A, DEG, strict=True):
        found.append(f"{t:.4f}," + ",".join(f"{x:.8g}" for x in a) + ",,,")
        found.append(f"{t + 3e-3:.4f},,,," + ",".join(f"{x:.8g}" for x in w))
    return "\n".join(found)


def tables() -> str:
    body = each("| {} | {} | {} | {} | {} | {} | {} |", ROWS)
    return f"| t | ax | ay | az | gx | gy | gz |\n|---|---|---|---|---|---|---|\n{body}"


def clock(form: str) -> list[str]:
    return [(BEGAN + timedelta(seconds=t)).strftime(form) for t in T.tolist()]


SIX = "ax,ay,az,gx,gy,gz"


FORMS: dict[str, Writer] = {
    "a word before each row": lambda: each(
        "IMU:{:.3f},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g}", T, A, W
    ),
    "a time with a colon before each row": lambda: each(
        "{:.0f}: {:.6g}, {:.6g}, {:.6g}, 27.31, {:.6g}, {:.6g}, {:.6g}",
        np.round(T * 1e6) + 99, A, W,
    ),
    "a word before each row, and others between": lambda: each(
        "$RAW: {:.3f};{:.6g};{:.6g};{:.6g};{:.6g};{:.6g};{:.6g}\nBAT:{:.3f};3.98;77",
        T, A, W, T,
    ),
    "lines of several kinds": mixed,
    "two sensors in turn": in_turn,
    "messages as ROS shows them": echoed,
    "lines with a checksum": checked,
    "hexadecimal counts": hexadecimal,
    "hexadecimal counts of 32 bits": hexadecimal_of_c,
    "lines that others describe": described,
    "counts below their scales": scaled,
    "records behind times in brackets": behind_brackets,
    "names between rows": again,
    "two sensors merged by time": merged_by_time,
    "counts beside what they are": lambda: lines(
        T, np.round(A * 8192 / G), np.round(DEG * 65.536), A / G, DEG,
        head="t,ax_raw,ay_raw,az_raw,gx_raw,gy_raw,gz_raw,"
        "ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps",
    ),
    "whole seconds of Unix": lambda: lines(
        [f"{UNIX + int(t + 0.4)}" for t in T.tolist()], A, W, head=f"epoch,{SIX}"
    ),
    "a device that is started twice": started_twice,
    "records behind a time": topics,
    "records behind a topic": lambda: "\n".join(
        "lab/imu/1 " + json.dumps({"t": r[0], "acc": r[1:4], "gyro": r[4:]})
        for r in ROWS.tolist()
    ),
    "rates of those who drive": lambda: lines(
        T, A, W[:, ::-1], head="t,ax,ay,az,YawRate,pitch_rate,rollRate"
    ),
    "rates of those who fly": lambda: lines(
        T, W, A, head="t,gyro_p,gyro_q,gyro_r,ax,ay,az"
    ),
    "counts of Analog Devices": lambda: lines(
        T, np.round(DEG * 10 * 2**16), np.round(A / G * 800 * 2**16),
        head="t,gx,gy,gz,ax,ay,az",
    ),
    "counts of 20 bits": lambda: lines(
        T, np.round(A / G * 32768), np.round(DEG * 262.144), head=f"t,{SIX}"
    ),
    "between bars": tables,
    "lists in cells": lambda: "t,accel,gyro\n"
    + each('{},"[{}, {}, {}]","[{}, {}, {}]"', ROWS),
    "tuples": lambda: each("{} ({}, {}, {}) ({}, {}, {})", ROWS),
    "as Python prints": lambda: "\n".join(
        str({"t": r[0], "acc": dict(zip("xyz", r[1:4], strict=True)), "gyro": r[4:]})
        for r in ROWS.tolist()
    ),
    "ESP-IDF": lambda: each(
        "I ({:.0f}) IMU: ax={} ay={} az={} gx={} gy={} gz={}", T * 1e3, A, W
    ),
    "a program's log": lambda: "\n".join(
        f"{c[:23].replace('.', ',')} INFO acc=({a[0]}, {a[1]}, {a[2]})"
        f" gyro=({w[0]}, {w[1]}, {w[2]})"
        for c, a, w in zip(clock("%Y-%m-%d %H:%M:%S.%f"), A, W, strict=True)
    ),
    "ST's units": lambda: lines(
        T * 1e6, np.round(A / G * 1e3, 2), np.round(DEG * 1e3),
        head="t[us],A_X[mg],A_Y[mg],A_Z[mg],G_X[mdps],G_Y[mdps],G_Z[mdps]",
    ),
    "thousandths without a word": lambda: lines(
        T, np.round(A / G * 1e6), np.round(DEG * 1e3), head=f"t,{SIX}"
    ),
    "degrees an hour": lambda: lines(
        T, A / G, DEG * 3600, head="time (s),fx (g),fy (g),fz (g),wx (deg/h),"
        "wy (deg/h),wz (deg/h)",
    ),
    "steps": lambda: lines(
        np.full(len(T), 20000.0), A, W, head=f"dt_us,{SIX}"
    ),
    "seconds and nanoseconds": lambda: lines(
        UNIX + np.floor(T), ["imu"] * len(T), np.round(T % 1 * 1e9), A, W
    ),
    "hours in one number": lambda: lines(
        [c[:-4] for c in clock("%H%M%S.%f")], A, W, head=f"time,{SIX}"
    ),
    "ticks of Windows": lambda: lines(
        [f"{133600000000000000 + round(t * 1e7)}" for t in T.tolist()], A, W,
        head=f"Timestamp,{SIX}",
    ),
    "minutes": lambda: lines(T / 60, A, W, head=f"time (min),{SIX}"),
    "a counter that ends": lambda: lines(
        np.mod(T * 1e6 + 2**32 - 9e6, 2**32), A, W, head=f"t_us,{SIX}"
    ),
    "days and hours": lambda: lines(
        [f"0 days {c}" for c in clock("%H:%M:%S.%f")], A, W, head=f"time,{SIX}"
    ),
    "counts without a sign": lambda: lines(
        T * 1e3,
        np.mod(np.round(np.hstack([A * 8192 / G, DEG * 65.536])), 2**16),
        head=f"time_ms,{SIX}",
    ),
    "gains": lambda: lines(455040 + T, W / 50, A / 50, sep=" "),
    "gravity apart": lambda: lines(
        T, W, UP, A / G - UP,
        head="time(s),rotation_rate_x(radians/s),rotation_rate_y(radians/s),"
        "rotation_rate_z(radians/s),gravity_x(G),gravity_y(G),gravity_z(G),"
        "user_acc_x(G),user_acc_y(G),user_acc_z(G)",
    ),
    "a rate among words": lambda: lines(
        A / G, DEG, head="# made by a logger at 50 Hz, filter 20\nax,ay,az,gx,gy,gz"
    ),
    "types beside names": lambda: lines(
        np.round(T * 1e6), W, A / G,
        head='# Data format: "%int(ChipTimeUS),'
        + ",".join(f"%float(Raw{s}{i})" for s in ("Gyro", "Accel") for i in "XYZ")
        + '"',
    ),
    "a rate in JSON": lambda: json.dumps(
        {"interval_ms": 20, "values": np.round(ROWS[:, 1:], 6).tolist()}
    ),
    "names in Chinese": lambda: lines(
        clock("%Y-%m-%d %H:%M:%S.%f"), ["WT901(ab:cd)"] * len(T), A / G, DEG,
        head="时间,设备名称,加速度X(g),加速度Y(g),加速度Z(g),角速度X(°/s),角速度Y(°/s),"
        "角速度Z(°/s)",
    ),
    "a time of day, and one with its date": lambda: lines(
        ["0x50"] * len(T), clock("%H:%M:%S.%f"), clock("%Y-%m-%d %H:%M:%S.%f"),
        A / G, DEG, sep="\t",
        head="address\tTime(s)\tChipTime\tax(g)\tay(g)\taz(g)\twx(deg/s)\twy(deg/s)"
        "\twz(deg/s)",
    ),
    "a time that nobody reads beside others": lambda: lines(
        np.round((UNIX + T) * 1e3), clock("%Y-%m-%dT%H.%M.%S.%f"), T, A / G, DEG,
        head=f"epoch (ms),time (02:00),elapsed (s),{SIX}",
    ),
    "a time that counts rows beside another": lambda: lines(
        np.round(T * 1e3), np.arange(float(len(T))), A / G, DEG,
        head=f"HostTimestamp (ms),NodeTimestamp,{SIX}",
    ),
    "ticks and an offset": lambda: lines(
        np.round(4.5e6 * T) + 917, T, A / G, DEG,
        head="Clock:Tick#,Clock:offsetTime,IMU(0):accelX,IMU(0):accelY,IMU(0):accelZ,"
        "IMU(0):gyroX,IMU(0):gyroY,IMU(0):gyroZ",
    ),
    "lines that end as a program's": lambda: each(
        "33,Up,{:.0f},{:.8g},{:.8g},{:.8g},{:.8g},{:.8g},{:.8g};", T * 1e9, A, W
    ),
    "seconds, and microseconds beyond them": lambda: lines(
        clock("%Y-%m-%d %H:%M:%S.%f"), UNIX + np.floor(T), np.round(T % 1 * 1e6),
        A, DEG,
        head="Human Timestamp,Unix Time,Microseconds,Accelerometer X,Accelerometer Y,"
        "Accelerometer Z,Gyroscope X,Gyroscope Y,Gyroscope Z",
    ),
    "topics side by side": lambda: lines(
        UNIX + T + 0.004, W, np.zeros(len(T)), UNIX + T, A,
        head="__time,"
        + ",".join(f"/imu/data/angular_velocity/{x}" for x in "xyz")
        + ",/imu/data/angular_velocity_covariance[0],/imu/data/header/stamp,"
        + ",".join(f"/imu/data/linear_acceleration/{x}" for x in "xyz"),
    ),
    "stamps beside arrivals": lambda: lines(
        UNIX + T + 0.007 * np.sin(T), UNIX + np.floor(T), np.round(T % 1 * 1e9), W, A,
        head="receive_time,ros_stamp_sec,ros_stamp_nanosec,angular_velocity_x,"
        "angular_velocity_y,angular_velocity_z,linear_acceleration_x,"
        "linear_acceleration_y,linear_acceleration_z",
    ),
    "a stamp beside its arrival": lambda: lines(
        UNIX + T + 0.007 * np.sin(T), UNIX + T, W, A,
        head="recv_time,msg_time,gx,gy,gz,ax,ay,az",
    ),
    "a chip before its values": lambda: "\n".join(
        f"{c[:-3]} -> ASM330LHH: | Acc[mg]: {a[0]:.2f} {a[1]:.2f} {a[2]:.2f}"
        f" | Gyr[mdps]: {w[0]:.1f} {w[1]:.1f} {w[2]:.1f} |"
        for c, a, w in zip(clock("%H:%M:%S.%f"), A / G * 1e3, DEG * 1e3, strict=True)
    ),
    "a program before its values": lambda: each(
        "IMU: T: {:.3f} Ax: {:.5f} Ay: {:.5f} Az: {:.5f} Gx: {:.5f} Gy: {:.5f}"
        " Gz: {:.5f} | Flow: X: 0 Y: 1 | LiDAR: 812mm", ROWS
    ),
    "a zone behind a space": lambda: lines(
        [f"{c[:-3]} +0200" for c in clock("%Y-%m-%d %H:%M:%S.%f")], -A / G, W,
        head="loggingTime(txt),"
        + ",".join(f"accelerometerAcceleration{x}(G)" for x in "XYZ") + ","
        + ",".join(f"gyroRotation{x}(rad/s)" for x in "XYZ"),
    ),
    "values for Teleplot": lambda: "\n".join(
        f">{name}:{UNIX * 1000 + round(row[0] * 1e3)}:{x:.6f}"
        for row in ROWS.tolist()
        for name, x in zip(SIX.split(","), row[1:], strict=True)
    ),
    "messages of VectorNav": vectornav,
    "channels of RaceCapture": lambda: lines(
        np.round(T * 1e3), ["" if i % 10 else "12.4" for i in range(len(T))], A / G,
        DEG[:, ::-1],
        head='"Interval"|"ms"|0|0|1,"Battery"|"Volts"|0.0|20.0|1,'
        + ",".join(f'"Accel{x}"|"G"|-3.0|3.0|50' for x in "XYZ") + ","
        + ",".join(f'"{x}"|"Deg/Sec"|-120|120|50' for x in ("Yaw", "Pitch", "Roll")),
    ),
    "a rate behind a rule": lambda: lines(
        DEG, A / G, sep="\t",
        head="Test report\nMeasurement rate, Hz ________________ 50\n\n"
        "Rate_X\tRate_Y\tRate_Z\tAcc_X\tAcc_Y\tAcc_Z",
    ),
    "names in Spanish": lambda: lines(
        T, A / G, DEG, head="Tiempo (s),Aceleración X (g),Aceleración Y (g),"
        "Aceleración Z (g),Giroscopio X (°/s),Giroscopio Y (°/s),Giroscopio Z (°/s)",
    ),
}  # fmt: skip
"""How each is written, of `ROWS`."""


def imported(path: Path, *more: str) -> Path:
    folder = path.parent / "out"
    assert main(["import", str(path), "-o", str(folder), *more]) == 0
    return folder


def assert_same(folder: Path, per_row: float = 0.02, tolerance: float = 1e-3) -> None:
    assert_rows(Session.open(folder).block, per_row, tolerance)


def assert_rows(block: Block, per_row: float = 0.02, tolerance: float = 1e-3) -> None:
    n = len(block)
    # the last of two sensors in turn may be alone
    assert len(T) - 2 <= n <= len(T)
    np.testing.assert_allclose(np.diff(block.t), per_row, atol=1.1e-3)
    np.testing.assert_allclose(block.acc, A[:n], atol=10 * tolerance)
    np.testing.assert_allclose(block.gyr, W[:n], atol=tolerance)
