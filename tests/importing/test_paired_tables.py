"""Arrays of sensors that have times of their own."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from laid_about import turned

from fieldcal.cli import main
from fieldcal.core.samples import Array, Block
from fieldcal.importing.arrays.array_tables import tables_of
from fieldcal.importing.arrays.paired_tables import pair_arrays
from fieldcal.session.folder import Session

Arrays = dict[str, Array]
LATE = 0.003
"""By what the gyroscope's clock is behind, s."""

ROWS = turned(4, 100.0)
OFTEN = np.arange(2 * len(ROWS)) / 200.0 + LATE
RATES = np.column_stack([np.interp(OFTEN, ROWS[:, 0], w) for w in ROWS[:, 4:7].T])


def apart() -> Arrays:
    return {"acc_t": ROWS[:, 0], "acc": ROWS[:, 1:4], "gyro_t": OFTEN, "gyro": RATES}


def with_times_inside() -> Arrays:
    return {
        "Acceleration": ROWS[:, :4],
        "AngularVelocity": np.column_stack([OFTEN, RATES]),
    }


def by_axis() -> Arrays:
    out = {"imu/accel/time": ROWS[:, 0], "imu/gyro/time": OFTEN}
    for i, axis in enumerate("xyz"):
        out |= {f"imu/accel/{axis}": ROWS[:, 1 + i], f"imu/gyro/{axis}": RATES[:, i]}
    return out


def in_groups() -> Arrays:
    names = ("imu/accel/time", "imu/accel/data", "imu/gyro/time", "imu/gyro/data")
    return dict(zip(names, apart().values(), strict=True))


def written(path: Path, arrays: Arrays) -> Path:
    """A file of arrays, as its name ends."""
    if path.suffix == ".npz":
        np.savez(path, **arrays)  # type: ignore[arg-type]
    elif path.suffix == ".h5":
        import h5py

        with h5py.File(path, "w") as file:
            for name, one in arrays.items():
                file[name] = one
    else:
        from scipy.io import savemat

        savemat(path, arrays)
    return path


def imported(path: Path) -> Block:
    out = path.parent / "out"
    assert main(["import", str(path), "-o", str(out), "--gyr-unit", "rad/s"]) == 0
    return Session.open(out).block


@pytest.mark.parametrize(
    ("file", "of"),
    [("log.npz", apart), ("log.mat", with_times_inside), ("log.h5", by_axis),
     ("log.h5", in_groups)],
)  # fmt: skip
def test_each_sample_goes_with_the_nearest_of_the_gyroscope(
    tmp_path: Path, file: str, of: Callable[[], Arrays]
) -> None:
    block = imported(written(tmp_path / file, of()))
    np.testing.assert_allclose(block.t, ROWS[:, 0] - ROWS[0, 0], atol=1e-9)
    np.testing.assert_allclose(block.acc, ROWS[:, 1:4], rtol=1e-9)
    nearest = [int(np.argmin(np.abs(OFTEN - t))) for t in ROWS[:, 0]]
    np.testing.assert_allclose(block.gyr, RATES[nearest], rtol=1e-9)


def test_as_many_samples_at_other_times_are_paired_by_time(tmp_path: Path) -> None:
    """Row by row the gyroscope would be half a second late."""
    arrays = apart() | {"gyro_t": ROWS[:, 0] + 0.5, "gyro": ROWS[:, 4:7]}
    block = imported(written(tmp_path / "log.npz", arrays))
    known = block.t >= 0.5
    assert np.isnan(block.gyr[~known]).all()
    np.testing.assert_allclose(block.gyr[known], ROWS[: known.sum(), 4:7], rtol=1e-9)


def test_a_slow_thermometer_goes_along_and_what_has_no_times_is_left() -> None:
    slow = np.arange(0.0, ROWS[-1, 0] + 5, 5.0)
    arrays = apart() | {"temp_t": slow, "temperature": 20 + slow, "odd": np.ones(7)}
    paired = pair_arrays(tables_of(arrays))
    assert paired is not None
    found = paired.of(tables_of(arrays))
    assert {table.shape[0] for table in found.values()} == {len(ROWS)}
    assert "odd" not in found and "gyro_t" not in found and "temp_t" not in found
    (warm,) = found["temperature"].read(slice(100, 900), [0])
    assert np.abs(warm - 20 - ROWS[100:900, 0]).max() <= 2.5 + 1e-9


@pytest.mark.parametrize("missing", ["acc_t", "gyro_t"])
def test_nothing_is_paired_by_guess(missing: str) -> None:
    arrays = apart()
    del arrays[missing]
    assert pair_arrays(tables_of(arrays)) is None


def test_times_that_go_back_are_no_clock() -> None:
    arrays = apart()
    arrays["gyro_t"] = arrays["gyro_t"][::-1]
    assert pair_arrays(tables_of(arrays)) is None
