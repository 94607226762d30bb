"""Lists and structures in the columns of a table are axes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.feather
import pyarrow.parquet
import pytest
from joined import read_files
from laid_about import turned

from fieldcal.cli import main
from fieldcal.core.errors import InputError

ROWS = turned(11, 50.0, 2.0)
T, A, W = ROWS[:, 0], ROWS[:, 1:4], ROWS[:, 4:]
XYZ = pa.struct([(axis, pa.float64()) for axis in "xyz"])


def structs(values: object) -> pa.Array:
    rows = np.asarray(values).tolist()
    return pa.array([dict(zip("xyz", row, strict=True)) for row in rows], XYZ)


TABLES = {
    "lists": {"acc": pa.array(A.tolist()), "gyr": pa.array(W.tolist())},
    "lists of one length": {
        "accelerometer": pa.array(A.tolist(), pa.list_(pa.float64(), 3)),
        "gyroscope": pa.array(W.tolist(), pa.list_(pa.float32(), 3)),
    },
    "structures": {"accel": structs(A), "gyro": structs(W)},
}


@pytest.mark.parametrize("ending", ["parquet", "feather"])
@pytest.mark.parametrize("name", TABLES)
def test_axes_lie_in_lists_and_structures(
    tmp_path: Path, name: str, ending: str
) -> None:
    path = tmp_path / f"log.{ending}"
    image = pa.array([[0] * 50] * len(T))
    table = pa.table({"time": T, "image": image, **TABLES[name]})
    if ending == "parquet":
        pyarrow.parquet.write_table(table, path, row_group_size=100)
    else:
        pyarrow.feather.write_feather(table, path)
    block, _ = read_files([path])
    np.testing.assert_allclose(block.acc, A, rtol=1e-9)
    np.testing.assert_allclose(block.gyr, W, rtol=1e-6)


def test_a_list_of_another_length_is_no_sample(tmp_path: Path) -> None:
    path = tmp_path / "log.parquet"
    lists = A.tolist()
    lists[5], lists[9] = [1.0, 2.0], None
    columns = {"time": T, "acc": pa.array(lists), "gyr": pa.array(W.tolist())}
    pyarrow.parquet.write_table(pa.table(columns), path)
    block, _ = read_files([path])
    assert np.isnan(block.acc[[5, 9]]).all()
    assert np.isfinite(np.delete(block.acc, [5, 9], axis=0)).all()


def test_places_of_lists_are_named_by_the_user(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "log.parquet"
    both = pa.array(np.hstack([A, W]).tolist())
    pyarrow.parquet.write_table(pa.table({"time": T, "signal": both}), path)
    names = [f"{c}=signal.{i}" for i, c in enumerate(("ax", "ay", "az", "gx"))]
    call = ["import", str(path), "-o", str(tmp_path / "out"), "--columns"]
    assert main([*call, ",".join(["t=time", *names])]) == 0
    capsys.readouterr()
    assert main([*call, "t=time,ax=signal.0,ay=signal.1,az=signal.9"]) == 2
    assert "has no column signal.9" in capsys.readouterr().err


def test_lists_of_all_lengths_are_asked_about(tmp_path: Path) -> None:
    path = tmp_path / "log.parquet"
    lists = pa.array([[float(i)] * (20 + i) for i in range(60)])
    pyarrow.parquet.write_table(pa.table({"t": np.arange(60) / 9, "a": lists}), path)
    with pytest.raises(InputError, match="say which are the channels"):
        read_files([path])
