"""Names of columns that say what is in them, and those that leave it open."""

from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from fieldcal.core.errors import InputError
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Block, concat
from fieldcal.importers import open_recording
from fieldcal.importing.headings.heading import Column
from fieldcal.importing.headings.headings import match_headings
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.recording import Recording
from fieldcal.importing.words.heading_units import UNITS
from fieldcal.importing.words.heading_words import heading_meaning

ROWS = np.column_stack([np.arange(4) * 1e3, np.arange(24).reshape(4, 6)])
"""Milliseconds, g, deg/s."""

NAMES = ("time_ms", "acc_x [g]", "acc_y [g]", "acc_z [g]") + (
    "GyroX (deg/s)",
    "GyroY (°/s)",
    "gyro_z_dps",
)

BARE = ("t", "ax", "ay", "az", "gx", "gy", "gz")


def text(path: Path, names: tuple[str, ...], separator: str = ",") -> Path:
    rows = [separator.join(map(str, row)) for row in ROWS.tolist()]
    path.write_text("\n".join([separator.join(names), *rows]) + "\n")
    return path


def taken(path: Path, wanted: ReadOptions | None = None) -> tuple[Recording, Block]:
    recording = open_recording(path, wanted or ReadOptions())
    (stream,) = recording.streams()
    return recording, concat(recording.blocks(stream.name))


def check(block: Block) -> None:
    np.testing.assert_allclose(block.t - block.t[0], np.arange(4))
    np.testing.assert_allclose(block.acc, ROWS[:, 1:4] * G0)
    np.testing.assert_allclose(block.gyr, np.deg2rad(ROWS[:, 4:]))


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_names_with_units_are_taken_and_said(tmp_path: Path, separator: str) -> None:
    recording, block = taken(text(tmp_path / "log", NAMES, separator))
    check(block)
    assert recording.says == [
        "taken from the names of its columns: --columns t,ax,ay,az,gx,gy,gz"
        " --acc-unit g --gyr-unit deg/s --time-unit ms"
    ]


def test_units_that_no_name_says_are_left_open(tmp_path: Path) -> None:
    path = text(tmp_path / "log", BARE)
    recording, block = taken(path)
    np.testing.assert_allclose(block.acc, ROWS[:, 1:4])
    assert "unit" not in recording.says[0]
    _, block = taken(path, ReadOptions(acc_unit="g", gyr_unit="deg/s", time_unit="ms"))
    check(block)


def test_columns_of_a_table_may_say_their_units_beside_their_names(
    tmp_path: Path,
) -> None:
    units = ["ms"] + 3 * ["g"] + 3 * ["dps"]
    fields = [
        pa.field(name, pa.float64(), metadata={"unit": unit})
        for name, unit in zip(BARE, units, strict=True)
    ]
    made = pa.table(list(ROWS.T), schema=pa.schema(fields))
    pyarrow.parquet.write_table(made, tmp_path / "x.parquet")
    check(taken(tmp_path / "x.parquet")[1])
    pyarrow.parquet.write_table(
        made.replace_schema_metadata().cast(
            pa.schema([(name, pa.float64()) for name in BARE])
        ),
        tmp_path / "y.parquet",
    )
    recording, _ = taken(tmp_path / "y.parquet")
    assert "--columns t=t,ax=ax,ay=ay" in recording.says[0]
    with h5py.File(tmp_path / "x.h5", "w") as file:
        for name, columns, unit in (
            ("imu/time", ROWS[:, 0], "ms"),
            ("imu/accel", ROWS[:, 1:4], "g"),
            ("imu/gyro", ROWS[:, 4:], "deg/s"),
        ):
            file[name] = columns
            file[name].attrs["units"] = unit
    recording, block = taken(tmp_path / "x.h5")
    check(block)
    for place in ("t=imu/time", "ax=imu/accel.0", "gz=imu/gyro.2"):
        assert place in recording.says[0]


@pytest.mark.parametrize(
    "kind",
    [pa.timestamp("ns"), pa.timestamp("ms", "UTC"), pa.duration("us"), pa.string()],
    ids=str,
)
def test_a_column_that_is_stored_as_times_is_one_whatever_its_name(
    tmp_path: Path, kind: pa.DataType
) -> None:
    ns = pa.array((ROWS[:, 0] * 1e6).astype("int64"), pa.int64())
    text = kind == pa.string()
    stored = ns.cast(pa.timestamp("ns")) if text else ns
    if not text:
        step = {"ns": 1, "us": 1000, "ms": 1_000_000}[kind.unit]
        stored = pa.array(ns.to_numpy() // step).cast(kind)
    columns = [stored.cast(pa.string()) if text else stored, *ROWS[:, 1:].T]
    name = "time" if text else "__index_level_0__"
    made = pa.table(columns, names=[name, *BARE[1:]])
    pyarrow.parquet.write_table(made, tmp_path / "x.parquet")
    _, block = taken(
        tmp_path / "x.parquet", ReadOptions(acc_unit="g", gyr_unit="deg/s")
    )
    check(block)


@pytest.mark.parametrize(
    "names",
    [
        ("t [s]", "ax [g]", "ay [g]"),
        ("t [s]", "ax [g]", "ay [g]", "az [g]", "acc_x [g]"),
        ("t [s]", "ax [g]", "ay [g]", "az [g]", "gx [deg/s]"),
        ("linear_acceleration_x", "linear_acceleration_y", "linear_acceleration_z"),
        ("1", "2", "3"),
    ],
)
def test_names_that_are_not_those_of_one_imu_say_nothing(
    names: tuple[str, ...],
) -> None:
    assert match_headings([Column("", name) for name in names], "_") == ()


def test_a_column_of_times_that_is_empty_is_none(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    head = ("// Update Rate: 100.0Hz", "PacketCounter\tSampleTimeFine\tSecond\t"
            "Acc_X\tAcc_Y\tAcc_Z\tGyr_X\tGyr_Y\tGyr_Z")  # fmt: skip
    rows = [f"{i:05d}\t\t\t" + "\t".join(map(str, row[1:]))
            for i, row in enumerate(ROWS.tolist())]  # fmt: skip
    path.write_text("\n".join([*head, *rows]) + "\n")
    _, block = taken(path)
    np.testing.assert_allclose(block.t, np.arange(4) / 100)
    np.testing.assert_allclose(block.acc, ROWS[:, 1:4])


def test_units_that_differ_say_nothing(tmp_path: Path) -> None:
    for third in ("az [mg]", "az"):
        names = ("ax [g]", "ay [g]", third)
        assert match_headings([Column("", name) for name in names], "_") == ()
        with pytest.raises(InputError, match="say what its columns are"):
            taken(text(tmp_path / "log", ("t", *names, *BARE[4:])))


@example(["T", "MILLIDEGC"])
@given(st.lists(st.text(max_size=12), max_size=8))
def test_any_names_are_understood_or_not(names: list[str]) -> None:
    """A file of its own may hold a thermometer and its times, and no more."""
    for found in match_headings([Column(name, name) for name in names]):
        warm = any(column.startswith("temperature=") for column in found.columns)
        assert len(found.columns) >= (2 if warm else 3)


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("imu1.AccX", ("a", "x", None)), ("gyro_rad[2]", ("g", "z", "rad/s")),
        ("sensor_combined/gyro_rad.01", ("g", "y", "rad/s")),
        ("gyro_angle_deg_x", ("g", "x", None)), ("ang_vel_z", ("g", "z", None)),
        ("accelerometer_m_s2[0]", ("a", "x", "m/s^2")), ("TimeUS", ("t", "", "us")),
        ("y (°/s)", ("g", "y", "deg/s")),
        ("field.angular_velocity.y", ("g", "y", None)),
        ("Acceleration z (m/s^2)", ("a", "z", "m/s^2")), ("ms", ("t", "", "ms")),
        ("seconds_elapsed", ("t", "", "s")), ("x_g", ("a", "x", "g")),
        ("baro_temp [degC]", ("temperature", "", "deg C")), ("mag_x", ("m", "x", None)),
        ("ax [LSB]", ("a", "x", None)), ("tx", None), ("x", None), ("", None),
        ("gravity_x", ("v", "x", None)), ("quat_w", None), ("GyX", ("g", "x", None)),
        ("w_RS_S_x [rad s^-1]", ("g", "x", "rad/s")), ("XACCL_OUT", ("a", "x", None)),
        ("Rotation Y [rad/s]", ("g", "y", "rad/s")), ("Rotation Y [deg]", None),
        ("Accelerometer (z) [m/s²]", ("a", "z", "m/s^2")), ("AngleX(°)", None),
        ("T(°)", ("temperature", "", "deg C")),
    ],
)  # fmt: skip
def test_what_a_name_says(name: str, says: tuple[str, str, str | None] | None) -> None:
    found = heading_meaning(name)
    assert (found and (found.kind, found.axis, found.unit)) == says


def test_a_name_that_comes_in_each_line_is_understood_once() -> None:
    """Three quarters of the time that labelled lines took."""
    assert heading_meaning("gyro x [deg/s]") is heading_meaning("gyro x [deg/s]")


def test_a_means_column_is_no_sample() -> None:
    names = [*BARE, "ax_std", "ay_std", "az_std"]
    (found,) = match_headings([Column("", name) for name in names], "_")
    assert found.columns == (*BARE, "_", "_", "_")


def test_several_imus_share_what_one_alone_has() -> None:
    names = ["t", *(f"imu{k}_{c}" for k in (0, 1) for c in BARE[1:4]), "gx", "gy", "gz"]
    names += ["imu1_temp", "baro_temp"]
    found = match_headings([Column("", name) for name in names])
    assert [one.name for one in found] == ["0", "1"]
    first, second = (
        match_headings([Column(n, n) for n in names])[i].columns for i in (0, 1)
    )
    assert {"t=t", "ax=imu0_ax", "gx=gx", "temperature=imu1_temp"} - {*first} == set()
    assert {"t=t", "ax=imu1_ax", "temperature=imu1_temp"} - {*second} == set()


def test_each_of_several_imus_has_its_own_time() -> None:
    names = [f"imu{k}_{c}" for k in (0, 1) for c in BARE]
    found = match_headings([Column(name, name) for name in names])
    assert [[c.partition("=")[2] for c in one.columns] for one in found] == [
        names[: len(BARE)], names[len(BARE) :]
    ]  # fmt: skip


def test_a_covariance_is_no_axis_and_topics_are_no_imus_of_their_own() -> None:
    names = ["__time", *(f"/imu/data/angular_velocity/{x}" for x in "xyz"),
             "/imu/data/angular_velocity_covariance[0]", "/imu/data/header/stamp",
             *(f"/imu/data/linear_acceleration/{x}" for x in "xyz"),
             "/odom/twist/angular_velocity/z"]  # fmt: skip
    (found,) = match_headings([Column("", name) for name in names], "_")
    assert found.columns == ("_", "gx", "gy", "gz", "_", "t", "ax", "ay", "az", "_")
    assert found.usual == "rad/s"


def test_two_columns_of_an_axis_leave_a_choice() -> None:
    names = ["t", "ax", "ay", "az", "az", "gx", "gy", "gz"]
    assert match_headings([Column("", name) for name in names], "_") == ()


@given(st.text(max_size=12), st.sampled_from(["", "[degC]", " °C", "_K", "(C)"]))
def test_any_name_is_read_or_left(name: str, unit: str) -> None:
    said = heading_meaning(name + unit)
    assert said is None or said.unit is None or said.unit in UNITS[said.kind]


@pytest.mark.parametrize("swapped", [False, True])
def test_the_clock_that_nobody_sets_is_the_time(swapped: bool) -> None:
    """As GNSSLogger writes them: a network sets the one, and it leaps."""
    clocks = ["utcTimeMillis", "elapsedRealtimeNanos"][:: -1 if swapped else 1]
    (found,) = match_headings([Column("", n) for n in (*clocks, *BARE[1:])], "_")
    assert found.columns[:2] == (("t", "_") if swapped else ("_", "t"))
    assert found.units["t"] == "ns"


def test_an_array_with_a_unit_is_three_axes() -> None:
    """As blackbox_decode writes it, behind a count of rows."""
    names = ["loopIteration", " time (us)", *(f" gyroADC[{i}] (deg/s)" for i in "012"),
             *(f" accSmooth[{i}] (g)" for i in "012")]  # fmt: skip
    (found,) = match_headings([Column("", name) for name in names], "_")
    assert found.columns == ("_", "t", "gx", "gy", "gz", "ax", "ay", "az")
    assert found.units == {"t": "us", "g": "deg/s", "a": "g"}
