"""What has another length at each rest is no gravity, whatever its usual length is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from joined import read_files
from laid_about import turned, write

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.importing.units.gravity_size import unequal_lengths


def shaken(seed: int) -> Array:
    """Accelerations without gravity, m/s^2, of a device that never rests (n, 3)."""
    rng = np.random.default_rng(seed)
    shakes = rng.normal(0, 1, (3020, 3)).cumsum(axis=0)
    smooth: Array = shakes[20:] - shakes[:-20]
    smooth /= np.median(np.linalg.norm(smooth, axis=1))
    return smooth


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("size", [1.0, 1.7, 9.8])
def test_accelerations_without_gravity_are_no_g(
    tmp_path: Path, seed: int, size: float
) -> None:
    rows = np.column_stack([np.arange(3000) / 50, size * shaken(seed)])
    path = write(tmp_path, rows, heading="time,acc_x,acc_y,acc_z")
    with pytest.raises(InputError, match="taken out of these accelerations") as asks:
        read_files([path])
    assert "--acc-unit" in str(asks.value)
    assert "--acc-lsb" not in str(asks.value)


def test_angles_are_no_accelerations(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    rests = 2048 * np.array([(1, 0, 0), (0, 1.6, 0), (0.5, 0.5, 0.5), (0, 0, 0.7)])
    held = np.repeat(rests, 400, axis=0) + rng.normal(0, 3, (1600, 3))
    rows = np.column_stack([np.arange(1600) / 50, np.round(held)])
    path = write(tmp_path, rows, heading="t,x,y,z")
    with pytest.raises(InputError, match="say what its columns are"):
        read_files([path])


def test_rows_of_zeros_are_no_other_length(tmp_path: Path) -> None:
    rows = turned(2, 50.0)
    rows[:150, 1:] = 0
    path = write(tmp_path, rows, heading="t,ax,ay,az,gx,gy,gz")
    with pytest.raises(InputError, match="hold only zeros"):
        read_files([path])


def test_gravity_with_any_bias_has_one_length() -> None:
    rows = turned(2, 50.0)[:, 1:4]
    for bias in ([0, 0, 0], [2.4, 0, 0], [0, -1.5, 1.5]):
        assert unequal_lengths(rows + bias) is None
        assert unequal_lengths(rows[: len(rows) // 2] + bias) is None


@pytest.mark.parametrize("axis", range(3))
def test_without_an_axis_lengths_tell_nothing(axis: int) -> None:
    """Which is a dead one: it is said of the recording, and not asked about."""
    rows = turned(2, 50.0)[:, 1:4]
    rows[:, axis] = 0.02
    assert unequal_lengths(rows) is None
