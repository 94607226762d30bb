"""Files of arrays with one IMU in each of several groups."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from laid_about import turned

from fieldcal.cli import main
from fieldcal.importing.arrays.array_groups import arrays_in_group, imu_groups
from fieldcal.importing.arrays.array_tables import tables_of
from fieldcal.session.folder import Session

UNITS = {"Accelerometer": "m/s^2", "Gyroscope": "rad/s", "Time": "microseconds",
         "Temperature": "deg C"}  # fmt: skip
Parts = dict[str, np.ndarray]


def part(seed: int, hold: float) -> Parts:
    rows = turned(seed, 50.0, hold)
    return {
        "Accelerometer": rows[:, 1:4],
        "Gyroscope": rows[:, 4:],
        "Magnetometer": 40 + rows[:, 1:4],
        "Temperature": 30 + 0.01 * rows[:, 0],
        "Time": np.round(rows[:, 0] * 1e6 + 1.6e15).astype(np.uint64),
    }


IMUS = {"XI-010284": part(1, 3.0), "XI-010293": part(2, 4.0)}
"""Each as long as it was worn, so that their arrays are of different lengths."""


def written(path: Path) -> Path:
    """A log in groups, as trackers of several wearable sensors write it."""
    if path.suffix == ".h5":
        import h5py

        with h5py.File(path, "w") as file:
            for imu, arrays in IMUS.items():
                for name, one in arrays.items():
                    file[f"Sensors/{imu}/{name}"] = one
                    if name in UNITS:
                        file[f"Sensors/{imu}/{name}"].attrs["Units"] = UNITS[name]
                file[f"Processed/{imu}/Orientation"] = np.ones((99, 4))
    elif path.suffix == ".mat":
        from scipy.io import savemat

        fields = {f"s{imu[-5:]}": arrays for imu, arrays in IMUS.items()}
        savemat(path, {"Sensors": fields})
    else:
        every = {f"{i}/{n}": a for i, one in IMUS.items() for n, a in one.items()}
        np.savez(path, **every)  # type: ignore[arg-type]
    return path


@pytest.mark.parametrize("ending", ["h5", "mat", "npz"])
def test_each_group_is_an_imu_with_times_of_its_own(
    tmp_path: Path, ending: str
) -> None:
    path, out = written(tmp_path / f"log.{ending}"), tmp_path / "out"
    assert main(["import", str(path), "-o", str(out)]) == 0
    folders = sorted(folder for folder in out.iterdir() if folder.is_dir())
    assert len(folders) == len(IMUS)
    for folder, arrays in zip(folders, IMUS.values(), strict=True):
        block = Session.open(folder).block
        assert len(block) == len(arrays["Time"])
        t = (arrays["Time"] - arrays["Time"][0]) / 1e6
        np.testing.assert_allclose(block.t - block.t[0], t, atol=1e-6)
        np.testing.assert_allclose(block.acc, arrays["Accelerometer"], atol=1e-9)
        np.testing.assert_allclose(block.gyr, arrays["Gyroscope"], atol=1e-9)
        np.testing.assert_allclose(block.temperature, arrays["Temperature"], atol=1e-9)


def test_one_imu_of_several_is_imported_by_its_name(tmp_path: Path) -> None:
    path, out = written(tmp_path / "log.h5"), tmp_path / "out"
    call = ["import", str(path), "-o", str(out), "--instance", "XI-010293"]
    assert main(call) == 0
    assert len(Session.open(out).block) == len(IMUS["XI-010293"]["Time"])


@pytest.mark.parametrize(
    ("names", "groups"),
    [
        (["imu/t", "imu/acc", "imu/gyr"], {}),
        (["t", "acc/data", "gyr/data"], {}),
        (["a/t", "a/acc", "a/gyr", "b/t", "b/acc", "b/gyr"], {"a": "a", "b": "b"}),
        (["x/a/acc", "x/a/gyr", "y/a/acc", "y/a/gyr"], {"x/a": "x/a", "y/a": "y/a"}),
        (["a/t", "a/acc", "b/t", "b/acc"], {"a": "a", "b": "b"}),
        (["a/t", "a/acc", "b/t", "b/acc", "b/gyr"], {}),
    ],
    ids=["one", "a sensor in each", "two", "of one name", "no rates", "one of two"],
)  # fmt: skip
def test_which_groups_hold_an_imu(names: list[str], groups: dict[str, str]) -> None:
    rows = turned(3, 50.0)
    held = {"t": rows[:, 0], "acc": rows[:, 1:4], "gyr": rows[:, 4:]}
    tables = tables_of(
        {n: held["acc" if "acc" in n else "gyr" if "gyr" in n else "t"] for n in names}
    )
    assert imu_groups(tables) == groups


def test_what_lies_within_a_group() -> None:
    names = dict.fromkeys(["a/t", "ab/t", "a/b/t"], 0)
    assert arrays_in_group("a", names).keys() == {"a/t", "a/b/t"}
    assert arrays_in_group("", names) == names
