"""Tables and texts in which each sensor has times of its own."""

from __future__ import annotations

from itertools import zip_longest
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from joined import read_files
from laid_about import turned

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.importing.headings.heading import Column
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.tables.own_times import own_times

SLOW, FAST = (turned(9, rate, 2.0) for rate in (50.0, 74.0))
"""The same turns, by the slower and the faster of two sensors."""

NAMES = "acc_time,acc_x,acc_y,acc_z,gyro_time,gyro_x,gyro_y,gyro_z"
ALIKE = "X [s],ACC.X,ACC.Y,ACC.Z,X [s],GYRO.X,GYRO.Y,GYRO.Z"


def beside(force: Array, rate: Array, rates_first: bool = False) -> list[str]:
    """Rows of both sensors, of which one ends before the other."""
    cells = [
        [",".join(f"{x:.10g}" for x in row) for row in rows]
        for rows in ((rate, force) if rates_first else (force, rate))
    ]
    return [",".join(row) for row in zip_longest(*cells, fillvalue=",,,")]


@pytest.mark.parametrize("head", [NAMES, ALIKE])
@pytest.mark.parametrize("rates_first", [False, True])
@pytest.mark.parametrize(("force", "rate"), [(SLOW, FAST), (FAST, SLOW)])
def test_each_sample_goes_with_the_nearest_in_time(
    tmp_path: Path, head: str, rates_first: bool, force: Array, rate: Array
) -> None:
    """Row by row the rates would be those of another moment.

    Where the gyroscopes are slower, only what has a partner is kept.
    """
    names = head.split(",")
    if rates_first:
        head = ",".join(names[4:] + names[:4])
    late = rate[:, [0, 4, 5, 6]] + [0.001, 0, 0, 0]
    path = tmp_path / "log.csv"
    rows = beside(force[:, :4], late, rates_first)
    path.write_text("\n".join([head, *rows]) + "\n")
    block, says = read_files([path])
    near = np.abs(late[:, :1] - force[:, 0]).argmin(axis=0)
    close = np.abs(late[near, 0] - force[:, 0]) < 0.5 * force[1, 0]
    kept = close | (force is SLOW)
    np.testing.assert_allclose(block.t, force[kept, 0], atol=1e-6)
    np.testing.assert_allclose(block.acc, force[kept, 1:4], rtol=1e-6, atol=1e-6)
    rates = block.gyr[close[kept]]
    np.testing.assert_allclose(rates, late[near[close], 1:], rtol=1e-6)
    assert any("times of their own" in one for one in says)


def test_columns_that_are_said_mean_what_the_names_do(tmp_path: Path) -> None:
    """As the import says them itself, to be given again."""
    path = tmp_path / "log.csv"
    path.write_text("\n".join([NAMES, *beside(SLOW[:, :4], FAST[:, [0, 4, 5, 6]])]))
    bare, _ = read_files([path])
    said, says = read_files(
        [path], ReadOptions(columns=("t", "ax", "ay", "az", "_", "gx", "gy", "gz"))
    )
    np.testing.assert_array_equal(said.gyr, bare.gyr)
    assert any("times of their own" in one for one in says)


def test_rates_at_no_time_of_the_forces_are_refused(tmp_path: Path) -> None:
    """As where every third second of one and of the other was written."""
    kept = [rows[np.floor(rows[:, 0] % 3) == k] for k, rows in ((0, SLOW), (2, FAST))]
    rows = beside(kept[0][:, :4], kept[1][:, [0, 4, 5, 6]])
    path = tmp_path / "log.csv"
    path.write_text("\n".join([NAMES, *rows]) + "\n")
    with pytest.raises(InputError, match="no sample at any of the accelerometers'"):
        read_files([path])


@given(st.permutations(range(8)), st.booleans(), st.floats(0.0, 0.004))
def test_times_that_name_their_sensor_are_found_wherever_they_stand(
    order: list[int], same: bool, later: float
) -> None:
    names = NAMES.split(",")
    table = np.random.default_rng(1).normal(size=(200, 8))
    table[:, 0] = 0.01 * np.arange(200)
    table[:, 4] = table[:, 0] + (0.0 if same else later + 1e-6)
    channels = dict(zip(("t", "ax", "ay", "az", "_", "gx", "gy", "gz"), range(8),
                        strict=True))  # fmt: skip
    at = {c: order.index(i) for c, i in channels.items() if c != "_"}
    columns = [Column("", names[i]) for i in order]
    found = own_times(columns, at, table[:, order])
    expected = (order.index(0), order.index(4))
    assert found is None if same else found == expected


def test_lines_of_a_sensor_with_a_time_above_each(tmp_path: Path) -> None:
    """As examples for stereo cameras print them, the rates at a higher rate."""
    lines = [
        (row[0], f"Accelerometer timestamp: {1e3 * row[0]:.3f} ms\n"
         "Accelerometer [m/s^2]: x: {:.6f} y: {:.6f} z: {:.6f}".format(*row[1:4]))
        for row in SLOW.tolist()
    ] + [
        (row[0], f"Gyroscope timestamp: {1e3 * row[0]:.3f} ms\n"
         "Gyroscope [rad/s]: x: {:.6f} y: {:.6f} z: {:.6f} ".format(*row[4:]))
        for row in FAST.tolist()
    ]  # fmt: skip
    path = tmp_path / "imu.txt"
    path.write_text("\n".join(text for _, text in sorted(lines)) + "\n")
    block, says = read_files([path])
    assert len(SLOW) - 2 <= len(block) <= len(SLOW)
    n = len(block)
    np.testing.assert_allclose(block.acc, SLOW[:n, 1:4], atol=1e-6)
    near = np.abs(FAST[:, :1] - SLOW[:n, 0]).argmin(axis=0)
    np.testing.assert_allclose(block.gyr[1:-1], FAST[near[1:-1], 4:], atol=1e-6)
    assert any("times of their own" in one for one in says)
