"""Names of columns that say what is in them, and those that leave it open."""

from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.core.errors import InputError
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Block, concat
from fieldcal.importers import open_recording
from fieldcal.importing.headings import Column, read
from fieldcal.importing.recording import ReadOptions, Recording

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


def test_what_is_offered_is_what_is_needed(tmp_path: Path) -> None:
    path = text(tmp_path / "log", BARE)
    with pytest.raises(InputError) as caught:
        taken(path)
    offered = (
        "give --columns t,ax,ay,az,gx,gy,gz --acc-unit 'm/s^2' --gyr-unit rad/s"
        " --time-unit s, with its units in place of these"
    )
    assert offered in str(caught.value)
    _, block = taken(path, ReadOptions(acc_unit="g", gyr_unit="deg/s", time_unit="ms"))
    check(block)
    with pytest.raises(InputError, match="--columns t,ax,ay,az,gx,gy,gz --acc-unit g"):
        taken(path, ReadOptions(acc_unit="g"))


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
    with pytest.raises(InputError, match="--columns t=t,ax=ax,ay=ay"):
        taken(tmp_path / "y.parquet")
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
    assert read([Column("", name) for name in names], "_") is None


def test_units_that_differ_or_have_no_scale_are_none() -> None:
    for third in ("az [mg]", "az", "az [LSB]"):
        found = read([Column("", name) for name in ("ax [g]", "ay [g]", third)], "_")
        assert found is not None and found.taken(ReadOptions()) is None


@given(st.lists(st.text(max_size=12), max_size=8))
def test_any_names_are_understood_or_not(names: list[str]) -> None:
    found = read([Column(name, name) for name in names])
    assert found is None or len(found.columns) >= 3
