"""Heads of logs of many makers, built here, are read as their columns say."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from joined import read_files
from laid_about import G, turned

from fieldcal.cli import main
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.importing.headings.heading import Column
from fieldcal.importing.headings.headings import match_headings
from fieldcal.importing.words.heading_words import heading_meaning
from fieldcal.session.folder import Session

ROWS = turned(7, 50.0, 2.0)
T, A, W = ROWS[:, 0], ROWS[:, 1:4], ROWS[:, 4:]
DEG, N = np.rad2deg(W), len(ROWS)
WARM = np.round(25 + T / 20, 2)


def text(head: str, *columns: Array | list[str], sep: str = ",") -> str:
    """Columns (n,) or (n, k), or cells, below a head."""
    cells = [
        c if isinstance(c, list)
        else [sep.join(f"{x:.9g}" for x in row) for row in np.reshape(c, (N, -1))]
        for c in columns
    ]  # fmt: skip
    return "\n".join([head, *(sep.join(row) for row in zip(*cells, strict=True))])


def clock_parts() -> str:
    """From 11:59:57.5: the minute and the hour begin anew."""
    ms = np.round((T + 11 * 3600 + 59 * 60 + 57.5) * 1e3).astype(int)
    parts = [ms // 3600000, ms // 60000 % 60, ms // 1000 % 60, ms % 1000]
    day = np.tile([2021, 3, 1], (N, 1))
    return text(
        "Year,Month,Day,Hour,Minute,Second,Millisecond,AccX,AccY,AccZ,GyrX,GyrY,GyrZ",
        day, np.column_stack(parts), A, W,
    )  # fmt: skip


def own_times() -> str:
    """A time before each channel; that of what comes first is another sensor's."""
    names = ["X[s]", "L.TIB: EMG 1[V]"]
    names += [f"X[s],L.TIB: Acc 1.{x}[g]" for x in "XYZ"]
    names += [f"X[s],L.TIB: Gyro 1.{x}[deg/s]" for x in "XYZ"]
    columns = [T / 10, np.sin(T)]
    for one in (*(A / G).T, *DEG.T):
        columns += [T, one]
    return text(",".join(names), *columns)


def in_columns_of_their_own() -> str:
    """Rows of the accelerometer, the gyroscope and an attitude in one table."""
    rows = ["timestamp,sensor,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,rot_w,rot_x"]
    for t, a, w in zip(T, A, W, strict=True):
        rows += [
            f"{t:.4f},rotation_vector,,,,,,,0.9,0.1",
            f"{t + 1e-3:.4f},accelerometer,"
            + ",".join(f"{x:.8g}" for x in a)
            + ",,,,,",
            f"{t + 2e-3:.4f},gyroscope,,,," + ",".join(f"{x:.8g}" for x in w) + ",,",
        ]
    return "\n".join(rows)


def device_addresses() -> str:
    """A device whose address stands in brackets, and cells without a value."""
    return text(
        "时间(s),设备名称,加速度X(g),加速度Y(g),加速度Z(g),角速度X(°/s),角速度Y(°/s),"
        "角速度Z(°/s),角度X(°),温度(°C),版本号(),电量(%)",
        T, ["WT(ef:e9:32:de:34:7f)"] * N, A / G, DEG, 10 * np.sin(T), WARM,
        ["null"] * N, 90 - T / 10,
    )  # fmt: skip


def behind_a_legend() -> str:
    """A number for the sensor, in any column, that lines above explain."""
    rows = ["%Accelerometer = 0", "%Gyroscope = 1", "%Magnetometer = 2"]
    rows += ["% TimeStamp; Sample No; X-Axis; Y-Axis; Z-Axis; Sensor Type; ID; "]
    for i, t in enumerate(T):
        for code, three in enumerate((A[i] / G, DEG[i], [20.0, 3.0, 40.0])):
            values = ";".join(f"{x:.9g}" for x in three)
            rows.append(f"{1e3 * t + code:.3f};{i};{values};{code};1")
    return "\n".join(rows)


def android_codes() -> str:
    rows = ["sensor_id,timestamp,v0,v1,v2"]
    for i, t in enumerate(T):
        for code, three in ((1, A[i]), (4, W[i]), (2, [20.0, 3.0, 40.0])):
            values = ",".join(f"{x:.9g}" for x in three)
            rows.append(f"{code},{1e9 * t + 1e5 * code:.0f},{values}")
    return "\n".join(rows)


def for_people() -> str:
    """Angles with their sign, lists with a unit behind, a count of ms in brackets."""
    return "\n".join(
        f"[{1e3 * t:8.0f}] Roll=  0.23°, Yaw= -8.92° | Accel: [{a[0]:.9f}, {a[1]:.9f},"
        f" {a[2]:.9f}] g | Gyro: [{w[0]:.8f}, {w[1]:.8f}, {w[2]:.8f}] °/s"
        for t, a, w in zip(T, A / G, DEG, strict=True)
    )


def quaternions(head: str, *columns: Array) -> str:
    """The quaternion of each turn, whose x y z are sin(angle / 2), behind a time."""
    angle = np.linalg.norm(W, axis=1, keepdims=True) / 50
    turn = np.column_stack([np.cos(angle / 2), np.sin(angle / 2) * W * 0.02 / angle])
    head = f"PacketCounter,SampleTimeFine,{head}"
    return text(head, np.arange(float(N)), 1e6 * T, turn, *columns)


def numbered_columns() -> str:
    """As loggers of cars write it: each cell in quotes, and no row of 1 to 7."""
    head = (
        '"Format","AiM CSV File"\n"Sample Rate","50"\n\n"Time","InlineAcc",'
        '"LateralAcc","VerticalAcc","RollRate","PitchRate","YawRate"\n"s","g","g",'
        '"g","deg/s","deg/s","deg/s"\n"1","2","3","4","5","6","7"\n'
    )
    rows = text("", T, A / G, DEG).strip().split("\n")
    return "\n".join([head, *('"' + row.replace(",", '","') + '"' for row in rows)])


FORMS: dict[str, tuple[Callable[[], str], bool]] = {
    "clock in columns": (clock_parts, False),
    "a time before each channel": (own_times, False),
    "a unit with a semicolon": (
        lambda: text(
            "Clock:offsetTime,IMU(0):Longitude[degrees [-180;180]],"
            + ",".join(f"IMU(0):accel:{x}[meters/Sec2]" for x in "XYZ")
            + "," + ",".join(f"IMU(0):gyro:{x}[degrees/Sec]" for x in "XYZ"),
            T, np.full(N, 7.1), A, DEG,
        ),
        False,
    ),
    "columns of their own": (in_columns_of_their_own, False),
    "addresses of devices": (device_addresses, True),
    "Japanese": (
        lambda: text(
            "時間(s),X軸加速度(g),Y軸加速度(g),Z軸加速度(g),X軸ジャイロ(dps),"
            "Y軸ジャイロ(dps),Z軸ジャイロ(dps),気温",
            T, A / G, DEG, WARM,
        ),
        True,
    ),
    "numbered axes": (
        lambda: text(
            "TimeStartup,UncompAccel0,UncompAccel1,UncompAccel2,UncompGyro0,"
            "UncompGyro1,UncompGyro2,Temp",
            T * 1e9, A, W, WARM,
        ),
        True,
    ),
    "thermometers within the sensors": (
        lambda: text(
            "Time[s];GyroX[°/s];GyroY[°/s];GyroZ[°/s];AccX[g];AccY[g];AccZ[g];"
            "TempGyroX[°C];TempGyroY[°C];TempAccX[°C]",
            T, DEG, A / G, WARM, WARM + 1, WARM - 1, sep=";",
        ),
        True,
    ),
    "the letters of those who fly": (
        lambda: text("time,Nx,Ny,Nz,p,q,r,phi,theta", T, A / G, DEG, DEG[:, :2] + 9),
        False,
    ),
    "gains of velocity and quaternions of turns": (
        lambda: quaternions("dq_W,dq_X,dq_Y,dq_Z,dv[1],dv[2],dv[3]", A * 0.02),
        False,
    ),
    "forces and numbered quaternions of turns": (
        lambda: quaternions(
            "OriInc_q0,OriInc_q1,OriInc_q2,OriInc_q3,Acc_X,Acc_Y,Acc_Z", A
        ),
        False,
    ),
    "numbers of the columns above the rows": (numbered_columns, False),
    "codes behind a legend": (behind_a_legend, False),
    "codes of Android": (android_codes, False),
    "labels with units": (for_people, False),
    "a thermometer called T": (
        lambda: text(
            "T [ms],AccX [mg],AccY [mg],AccZ [mg],GyroX [dps],GyroY [dps],GyroZ [dps],"
            "P [mB],T ['C]",
            T * 1e3, A / G * 1e3, DEG, 1013 + 0 * T, WARM,
        ),
        True,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", FORMS)
def test_a_head_is_read_as_it_says(tmp_path: Path, name: str) -> None:
    write, warm = FORMS[name]
    path = tmp_path / "log.csv"
    path.write_text(write() + "\n", encoding="utf-8")
    block, _ = read_files([path])
    np.testing.assert_allclose(block.t - block.t[0], T - T[0], atol=2e-6)
    np.testing.assert_allclose(block.acc, A, atol=2e-6)
    # of a turn of 2 deg, twice the sine of its half lacks 5e-5 of it
    np.testing.assert_allclose(block.gyr, W, atol=2e-6, rtol=5e-5)
    assert np.isfinite(block.temperature).all() == warm
    if warm:
        np.testing.assert_allclose(block.temperature, WARM, atol=1e-6)


@pytest.mark.parametrize(
    "head",
    [
        # settings of each channel between the names and the rows
        "*NAME\nM1;M1;M1\n*DELAY\n0.01;0.01;0.01\n*CHANNEL\nTIME;ACC x;ACC y;ACC z\n"
        "*UNIT\ns;mg;mg;mg\n*LIMITS\n*CALIBRATION\n*FILTER\n*DATA",
        "Zeit [s];X-Achse [mg];Y-Achse [mg];Z-Achse [mg]",
    ],
)
def test_an_accelerometer_alone_has_the_unit_of_its_head(
    tmp_path: Path, head: str
) -> None:
    """Counts of 1024 in a g would be as near to gravity."""
    path = tmp_path / "log.csv"
    path.write_text(text(head, T, np.round(A / G * 1e3), sep=";") + "\n")
    block, _ = read_files([path])
    np.testing.assert_allclose(block.acc, A, atol=6e-3)


def test_codes_of_several_devices_are_not_paired(tmp_path: Path) -> None:
    """A gyroscope of one device does not go with an accelerometer of another."""
    path = tmp_path / "log.csv"
    rows = ["Accelerometer = 0", "Gyroscope = 1", "time;x;y;z;Sensor Type;Sensor ID"]
    for i, t in enumerate(T):
        for code, three in enumerate((A[i] / G, DEG[i])):
            for device in (1, 2):
                values = ";".join(f"{x:.6g}" for x in three)
                rows.append(f"{t:.3f};{values};{code};{device}")
    path.write_text("\n".join(rows) + "\n")
    with pytest.raises(InputError, match="say what its columns are"):
        read_files([path])


def test_a_pause_of_minutes_is_one_where_the_clock_has_columns(tmp_path: Path) -> None:
    """By the seconds alone it would be a few seconds."""
    path = tmp_path / "log.csv"
    s = T + 50 + np.where(T > 10, 125.0, 0.0)
    table = text(
        "hour,minute,second,ax,ay,az,gx,gy,gz",
        np.full(N, 12), s // 60, np.round(s % 60, 4), A, W,
    )  # fmt: skip
    path.write_text(table + "\n")
    block, _ = read_files([path])
    assert block.t[-1] - block.t[0] == pytest.approx(s[-1] - s[0])


@pytest.mark.parametrize(
    ("heads", "imus"),
    [
        (
            "Low_Noise_Accelerometer_{0}_cal Wide_Range_Accelerometer_{0}_cal"
            " Gyroscope_{0}_cal",
            {"low_noise_cal": (0, 2), "wide_range_cal": (1, 2)},
        ),
        (
            "Aceleración|{0}|(g)|Primaria Giroscopio|{0}|(°/s)|Primaria"
            " Aceleración|{0}|(g)|Secundaria Giroscopio|{0}|(°/s)|Secundaria",
            {"primaria": (0, 1), "secundaria": (2, 3)},
        ),
        (
            "AnkleAccelerometer|{0}-axis|(g) AnkleAngularVelocity|{0}|(deg/s)"
            " BeltAccelerometer|{0}-axis|(g) BeltAngularVelocity|{0}|(deg/s)",
            {"ankle": (0, 1), "belt": (2, 3)},
        ),
        (
            "acc_left_shank_{0} gyr_shank_left_{0} acc_right_thigh_{0} gyr_thigh_{0}",
            {"left_shank": (0, 1), "right_thigh": (2, 3)},
        ),
        # what stands in brackets before the unit, or with a number
        (
            "Acc{0}|(bmi)|(g) Gyr{0}|(bmi)|(dps) Acc{0}|(icm)|(g) Gyr{0}|(icm)|(dps)",
            {"bmi": (0, 1), "icm": (2, 3)},
        ),
        ("Acc{0}|(1) Gyr{0}|(1) Acc{0}|(2) Gyr{0}|(2)", {"1": (0, 1), "2": (2, 3)}),
        (
            "accel_{0}_x1 gyro_{0}_x1 accel_{0}_x2 gyro_{0}_x2",
            {"x_1": (0, 1), "x_2": (2, 3)},
        ),
        (
            "gx3.accel.{0} gx3.gyro.{0} mpu.accel.{0} mpu.gyro.{0}",
            {"gx_3": (0, 1), "mpu": (2, 3)},
        ),
        # an r is no yaw rate where an axis stands beside it
        ("L_Acc{0} L_Gyr{0} R_Acc{0} R_Gyr{0}", {"l": (0, 1), "r": (2, 3)}),
        # of counts and what is made of them the latter; nothing in axes of the Earth
        ("accel_{0} gyro_{0} accel_{0}_g gyro_{0}_dps GlobalAcc{0}", {"0": (2, 3)}),
    ],
)
def test_each_accelerometer_has_its_gyroscope(
    heads: str, imus: dict[str, tuple[int, int]]
) -> None:
    names = [one.replace("|", " ").format(x) for one in heads.split() for x in "XYZ"]
    found = match_headings([Column("", name) for name in ("time", *names)], "_")
    assert {one.name for one in found} == {*imus}
    for one in found:
        for kind, three in zip("ag", imus[one.name], strict=True):
            first = 1 + 3 * three
            called = one.columns[first : first + 3]
            assert called == tuple(kind + axis for axis in "xyz")


def test_gyroscopes_of_no_accelerometer_are_said() -> None:
    heads = "acc_left_{0} acc_right_{0} gyr_hip_{0} gyr_head_{0}".split()
    names = [one.format(x) for one in heads for x in "xyz"]
    found = match_headings([Column("", name) for name in ("time", *names)], "_")
    assert [one.name for one in found] == ["left", "right"]
    assert "gyr_hip_x, gyr_hip_y, gyr_hip_z: go with no" in " ".join(found[0].says)


def test_rows_share_the_second_of_a_clock_in_columns(tmp_path: Path) -> None:
    """Seconds alone, of which each has as many rows, over the end of a minute."""
    path = tmp_path / "log.csv"
    s = np.floor(T + 58)
    table = text(
        "hour,minute,second,ax,ay,az,gx,gy,gz",
        np.full(N, 12), s // 60, s % 60, A, W,
    )  # fmt: skip
    path.write_text(table + "\n")
    block, _ = read_files([path])
    np.testing.assert_allclose(np.diff(block.t), 0.02, atol=1e-6)


def still(head: str, noise: float = 0.05) -> str:
    """A device that lies for a minute, with biases of 0.1 and 0.2 deg/s, and noise."""
    rng = np.random.default_rng(9)
    t = np.arange(3000) / 50
    acc = [0, 0, 1] + rng.normal(0, 2e-3, (3000, 3))
    gyr = [0.1, -0.2, 0.1] + rng.normal(0, noise, (3000, 3))
    rows = np.column_stack([t, acc, gyr])
    return "\n".join([head, *(",".join(f"{x:.6f}" for x in row) for row in rows)])


@pytest.mark.parametrize(
    "head",
    [
        "Time (UTC),Force Xv (g),Force Yv (g),Force Zv (g),Spin Xv (°/s),Spin Yv (°/s),"
        "Spin Zv (°/s)",
        "UTC Time,XV1 Load (g),XV2 Load (g),XV3 Load (g),XV1 Rot (deg/s),XV2 Rot"
        " (deg/s),XV3 Rot (deg/s)",
    ],
)
def test_columns_that_physics_tells_have_the_units_of_their_names(
    tmp_path: Path, head: str
) -> None:
    """Without a turn rad/s would be as usual."""
    path = tmp_path / "log.csv"
    path.write_text(still(head) + "\n")
    block, says = read_files([path])
    rates = np.rad2deg(block.gyr.mean(axis=0))
    np.testing.assert_allclose(rates, [0.1, -0.2, 0.1], atol=0.01)
    assert [one for one in says if "--gyr-unit deg/s" in one]


@pytest.mark.parametrize("gained", [0.02, 1.0])
def test_half_the_angle_is_told_by_its_name_without_a_turn(
    tmp_path: Path, gained: float
) -> None:
    path, rng = tmp_path / "log.csv", np.random.default_rng(3)
    acc = [0, 0, G] + rng.normal(0, 0.02, (N, 3))
    turn = 0.5 * 0.02 * ([0.01, -0.02, 0.01] + rng.normal(0, 2e-3, (N, 3)))
    force = "dv[1],dv[2],dv[3]" if gained < 1 else "Acc_X,Acc_Y,Acc_Z"
    head = f"SampleTimeFine,dQ_W,dQ_X,dQ_Y,dQ_Z,{force}"
    path.write_text(text(head, 1e6 * T, np.ones(N), turn, acc * gained) + "\n")
    block, _ = read_files([path])
    np.testing.assert_allclose(block.gyr, 100 * turn, atol=1e-6)
    np.testing.assert_allclose(block.acc, acc, atol=1e-6)


@pytest.mark.parametrize(("tick", "said"), [(0.79, True), (1.0, False)])
def test_a_timer_that_counts_no_us_is_told_by_the_turns(
    tmp_path: Path, tick: float, said: bool
) -> None:
    """The 16-bit timer of Crossbow's units counts 0.79 us."""
    path = tmp_path / "log.csv"
    counts = np.round(T / tick * 1e6) % 65536
    head = "time,ax (g),ay (g),az (g),gx (deg/s),gy (deg/s),gz (deg/s)"
    path.write_text(text(head, counts, A / G, DEG) + "\n")
    _, says = read_files([path])
    told = [one for one in says if "nothing says the unit of its times" in one]
    assert len(told) == said
    assert all("rates are 1.2" in one and "--rate (about " in one for one in told)


def test_rates_of_names_that_tell_no_unit_are_asked_about(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(still("time,Nx,Ny,Nz,p,q,r", 0.12) + "\n")
    with pytest.raises(InputError, match="nothing says the unit of its rates"):
        read_files([path])


def test_a_letter_that_goes_up_and_down_is_no_time(tmp_path: Path) -> None:
    """Counts of a thermometer behind the axes are asked about as such."""
    path = tmp_path / "log.csv"
    counts = np.round(340 * (WARM - 36.53) + 9 * np.sin(9 * T))
    head = "ax (g),ay (g),az (g),gx (deg/s),gy (deg/s),gz (deg/s),T"
    path.write_text("Fs,50\n" + text(head, A / G, DEG, counts) + "\n")
    with pytest.raises(InputError, match="its temperature reads -.*which is no deg C"):
        read_files([path])


def test_what_lacks_gravity_is_no_gain_of_velocity(tmp_path: Path) -> None:
    """Its bias may be as long as what gravity gains in a step of 10 ms."""
    path = tmp_path / "log.csv"
    rng = np.random.default_rng(3)
    free = 0.098 * np.array([0.6, 0.0, 0.8]) + rng.normal(0, 1e-3, (N, 3))
    path.write_text(text("time_ms,FreeAcc_X,FreeAcc_Y,FreeAcc_Z", T * 500, free) + "\n")
    with pytest.raises(InputError, match="seems to be taken out"):
        read_files([path])


def test_what_is_called_acceleration_is_no_gain_of_velocity(tmp_path: Path) -> None:
    """A car without gravity, four rows a second: about what gravity gains in one."""
    path = tmp_path / "log.csv"
    rng = np.random.default_rng(5)
    some, step = 22, 0.2405
    free = np.array([0.0, 2.35, 0.0]) + rng.normal(0, 0.05, (some, 3))
    rows = np.column_stack([step * np.arange(some), free])
    head = "time,accel_x,accel_y,accel_z\n"
    path.write_text(head + "\n".join(",".join(map(str, r)) for r in rows) + "\n")
    with pytest.raises(InputError, match="gravity in no usual unit"):
        read_files([path])


@pytest.mark.parametrize("unit", ["", " (m/s^2)", " [m/s²]"])
def test_about_one_without_gravity_is_no_g(tmp_path: Path, unit: str) -> None:
    """A telephone in a lift reads 1 m/s^2 for a while."""
    path = tmp_path / "log.csv"
    lift = np.array([0.0, 0.1, 1.05]) + np.random.default_rng(6).normal(0, 0.02, (N, 3))
    head = ",".join(f"Linear Acceleration {x}{unit}" for x in "xyz")
    path.write_text(text("Time (s)," + head, T, lift) + "\n")
    with pytest.raises(InputError, match="accelerations without gravity"):
        read_files([path])


def test_of_two_linear_accelerations_that_with_gravity_is_taken(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    head = "time,lin_acc_x,lin_acc_y,lin_acc_z," + ",".join(
        f"linear_acceleration.{x}" for x in "xyz"
    )
    lacking = np.random.default_rng(1).normal(0, 0.1, (N, 3))
    path.write_text(text(head, T, lacking, A) + "\n")
    block, _ = read_files([path])
    np.testing.assert_allclose(block.acc, A, atol=2e-6)


def test_gravity_is_not_added_to_counts_that_hold_it(tmp_path: Path) -> None:
    """Twice as many counts in a g would be usual as well."""
    path = tmp_path / "log.csv"
    head = "time," + ",".join(
        f"{name}_{x}" for name in ("linear_acceleration", "gravity") for x in "xyz"
    )
    counts = np.round(A / G * 16384)
    down = np.round(counts / np.linalg.norm(counts, axis=1)[:, None] * 16384)
    path.write_text(text(head, T, counts, down) + "\n")
    block, _ = read_files([path])
    np.testing.assert_allclose(block.acc, A, atol=1e-3)


def test_gains_of_velocity_go_before_what_lacks_gravity(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    head = "time_ms,dv[1],dv[2],dv[3],FreeAcc_X,FreeAcc_Y,FreeAcc_Z"
    path.write_text(text(head, T * 1e3, A * 0.02, A * 0.01) + "\n")
    block, _ = read_files([path])
    np.testing.assert_allclose(block.acc, A, atol=2e-6)


def test_an_imu_that_comes_late_is_one_of_its_own(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its rows are no rows of the others."""
    path = tmp_path / "log.csv"
    late = 520  # rows, behind the thousand lines by which a text is judged
    rows = ["id,t,ax,ay,az,gx,gy,gz"]
    for i, row in enumerate(ROWS):
        for name in ("1", "2", "3") if i > late else ("1", "2"):
            rows.append(f"{name}," + ",".join(f"{x:.8g}" for x in row))
    path.write_text("\n".join(rows) + "\n")
    out = tmp_path / "out"
    assert main(["import", str(path), "-o", str(out)]) == 0
    capsys.readouterr()
    many = {p.name: len(Session.open(p).block.t) for p in out.iterdir()}
    assert many == {"1": N, "2": N, "3": N - late - 1}


def test_an_imu_that_wakes_late_is_not_said_to_hold_zeros(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "log.csv"
    asleep = N * 9 // 20
    rows = ["id,t,ax,ay,az,gx,gy,gz"]
    for i, row in enumerate(ROWS):
        rows.append("1," + ",".join(f"{x:.8g}" for x in row))
        own = row if i >= asleep else [row[0], *[0.0] * 6]
        rows.append("2," + ",".join(f"{x:.8g}" for x in own))
    path.write_text("\n".join(rows) + "\n")
    out = tmp_path / "out"
    assert main(["import", str(path), "-o", str(out)]) == 2
    assert "hold only zeros; mend the file, or leave" in capsys.readouterr().err
    assert main(["import", str(path), "--repair", "-o", str(out)]) == 0
    many = {p.name: len(Session.open(p).block.t) for p in out.iterdir()}
    assert many == {"1": N, "2": N - asleep}


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("G(x)", ("a", "x", "g")),  # what a telephone feels in a car
        ("gx", ("g", "x", None)),
        ("가속도X(g)", ("a", "x", "g")),
        ("각속도X(dps)", ("g", "x", "deg/s")),
        ("Prędkość kątowa X [rad/s]", ("g", "x", "rad/s")),
        ("Угловая скорость X", ("g", "x", None)),
        ("Vitesse angulaire x (rad/s)", ("g", "x", "rad/s")),
        ("Accel X (m/s^2) left", ("a", "x", "m/s^2")),
        ("X[s]", ("t", "", "s")),
        ("Time of day [h]", ("t", "", "h")),
        ("x (m/s^2)", ("a", "x", "m/s^2")),
    ],
)
def test_what_names_in_other_words_say(name: str, says: tuple[str, ...]) -> None:
    said = heading_meaning(name)
    assert said is not None and (said.kind, said.axis, said.unit) == says
