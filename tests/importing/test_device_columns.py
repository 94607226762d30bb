"""Files in which a column says of which of several devices a row is."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from laid_about import turned

from fieldcal.cli import main
from fieldcal.core.samples import Array
from fieldcal.session.folder import Session

ONE = turned(21, 50.0, 2.0)
OTHER = ONE * [1, 1.03, 1.03, 1.03, 1, 1, 1] + [0.004, 0, 0, 0, 0.01, 0, 0]
NAMES = ("t", "ax", "ay", "az", "gx", "gy", "gz")
BOTH = {"0": ONE, "1": OTHER}


def behind_each_other() -> tuple[Array, Array]:
    """Number of the device (n,) and rows (n, 7), those of one behind the other's."""
    return np.repeat([0, 1], len(ONE)), np.vstack([ONE, OTHER])


def in_turn() -> tuple[Array, Array]:
    rows = np.stack([ONE, OTHER], axis=1).reshape(-1, len(NAMES))
    return np.tile([0, 1], len(ONE)), rows


def as_text(device: Array, rows: Array, name: str = "device_id") -> str:
    lines = [",".join([name, *NAMES])]
    lines += [f"{k}," + ",".join(f"{x:.9g}" for x in row)
              for k, row in zip(device, rows, strict=True)]  # fmt: skip
    return "\n".join(lines) + "\n"


def write_text(path: Path, device: Array, rows: Array) -> None:
    path.write_text(as_text(device, rows))


def write_last(path: Path, device: Array, rows: Array) -> None:
    """Below the name of the place at which it was worn, behind the numbers."""
    text = as_text(device, rows, "sensor_location").split("\n")[:-1]
    ends = [line.partition(",") for line in text]
    path.write_text("\n".join(f"{values},{name}" for name, _, values in ends) + "\n")


def write_wearers(path: Path, device: Array, rows: Array) -> None:
    text = as_text(device, rows, "Subject").replace("\n", "\n7,")
    path.write_text(f"trial,{text}"[:-2])


def write_parquet(path: Path, device: Array, rows: Array) -> None:
    named = dict(zip(NAMES, rows.T, strict=True))
    texts = pa.array(device.astype(str)).dictionary_encode()
    pq.write_table(pa.table(named | {"Device": texts}), path, row_group_size=100)


def write_feather(path: Path, device: Array, rows: Array) -> None:
    table = pa.table(dict(zip(NAMES, rows.T, strict=True)) | {"imu": device})
    with pa.ipc.new_file(path, table.schema) as file:
        file.write_table(table)


def write_hdf5(path: Path, device: Array, rows: Array) -> None:
    with h5py.File(path, "w") as file:
        file["sensor_id"], file["time"] = device, rows[:, 0]
        file["acc"], file["gyr"] = rows[:, 1:4], rows[:, 4:]
        file["times of another kind"] = np.arange(5)


def write_npy(path: Path, device: Array, rows: Array) -> None:
    table = np.zeros(len(rows), [("node", "<i4"), *((name, "<f8") for name in NAMES)])
    for name, column in zip(("node", *NAMES), (device, *rows.T), strict=True):
        table[name] = column
    with path.open("wb") as file:
        np.save(file, table)


def write_json(path: Path, device: Array, rows: Array) -> None:
    path.write_text("\n".join(
        json.dumps({"sensor_id": int(k), **dict(zip(NAMES, row, strict=True))})
        for k, row in zip(device, rows.tolist(), strict=True)
    ))  # fmt: skip


@pytest.mark.parametrize("order", [behind_each_other, in_turn])
@pytest.mark.parametrize(
    "write",
    [write_text, write_last, write_wearers, write_parquet, write_feather, write_hdf5,
     write_npy, write_json],
)  # fmt: skip
def test_each_device_has_a_session_of_its_own_rows(
    write: Callable[[Path, Array, Array], None],
    order: Callable[[], tuple[Array, Array]],
    tmp_path: Path,
) -> None:
    path, out = tmp_path / "log", tmp_path / "out"
    write(path, *order())
    assert main(["import", str(path), "-o", str(out)]) == 0
    assert {one.name for one in out.iterdir()} == {*BOTH}
    for name, rows in BOTH.items():
        block = Session.open(out / name).block
        np.testing.assert_allclose(np.diff(block.t), np.diff(rows[:, 0]), atol=1e-6)
        np.testing.assert_allclose(block.acc, rows[:, 1:4], atol=1e-6)
        np.testing.assert_allclose(block.gyr, rows[:, 4:], atol=1e-6)


def test_two_devices_of_one_model_are_told_by_the_device(tmp_path: Path) -> None:
    device, rows = in_turn()
    text = as_text([f"nexus4_{k}" for k in device], rows, "Device")  # type: ignore[arg-type]
    lines = [f"{'model' if i == 0 else 'nexus4' if i % 5 else 'nexus 4'},{line}"
             for i, line in enumerate(text.split("\n")[:-1])]  # fmt: skip
    path, out = tmp_path / "log.csv", tmp_path / "out"
    path.write_text("\n".join(lines))
    assert main(["import", str(path), "-o", str(out)]) == 0
    assert {one.name for one in out.iterdir()} == {"nexus4_0", "nexus4_1"}


def test_a_device_with_hardly_a_row_is_left_out_and_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    device, rows = behind_each_other()
    path, out = tmp_path / "log.csv", tmp_path / "out"
    stray = as_text(np.full(5, 8), OTHER[:5]).split("\n", 1)[1]
    path.write_text(as_text(device, rows) + stray)
    assert main(["import", str(path), "-o", str(out)]) == 0
    assert {one.name for one in out.iterdir()} == {*BOTH}
    assert "8 has fewer than 20 rows: it is left out" in capsys.readouterr().err
    assert len(Session.open(out / "1").block) == len(OTHER)


def test_a_few_rows_of_another_device_spoil_none(tmp_path: Path) -> None:
    path, out = tmp_path / "log.csv", tmp_path / "out"
    own = turned(21, 50.0, 2.0, sides=7)  # more lines than those at the top
    stray = as_text(np.full(5, 8.0), OTHER[:5]).split("\n", 1)[1]
    path.write_text(as_text(np.full(len(own), 7.0), own) + stray)
    assert main(["import", str(path), "-o", str(out)]) == 0
    np.testing.assert_allclose(Session.open(out).block.acc, own[:, 1:4], atol=1e-6)


@pytest.mark.parametrize(
    "write",
    [write_text, write_last, write_parquet, write_feather, write_hdf5, write_npy,
     write_json],
)  # fmt: skip
def test_one_device_whose_time_goes_on_is_not_divided(
    write: Callable[[Path, Array, Array], None], tmp_path: Path
) -> None:
    """As where the column of a module says what it did."""
    path, out = tmp_path / "log", tmp_path / "out"
    write(path, np.repeat([0, 1, 2], [400, 400, len(ONE) - 800]), ONE)
    assert main(["import", str(path), "-o", str(out)]) == 0
    np.testing.assert_allclose(Session.open(out).block.acc, ONE[:, 1:4], atol=1e-6)


@pytest.mark.parametrize("name", ["id", "position", "trial", "label"])
def test_what_counts_parts_of_one_recording_divides_none(
    name: str, tmp_path: Path
) -> None:
    path, out = tmp_path / "log.csv", tmp_path / "out"
    path.write_text(as_text(np.arange(float(len(ONE))) // 100, ONE, name))
    assert main(["import", str(path), "-o", str(out)]) == 0
    np.testing.assert_allclose(Session.open(out).block.acc, ONE[:, 1:4], atol=1e-6)
