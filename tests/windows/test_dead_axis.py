"""Axes without a signal in the whole recording."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import ACC, GYR, Array, Block
from fieldcal.windows import dead_axis
from fieldcal.windows.dead_axis import (
    DeadSensor,
    LiveAxisRows,
    broken_axis_messages,
    dead_sensors,
    without_dead_axes,
)


def block_of(six: Array) -> Block:
    return Block.of(np.arange(len(six)) / 100.0, six[:, ACC], six[:, GYR])


def dead(six: Array) -> list[DeadSensor]:
    return dead_sensors(six[:, ACC], six[:, GYR])


def test_an_axis_that_changes_once_is_not_dead() -> None:
    six = np.zeros((50, 6))
    six[30] = 1e-9
    assert dead(six) == []


def test_beside_axes_as_coarse_it_may_only_not_be_turned() -> None:
    six = np.round(np.random.default_rng(2).normal(size=(500, 6)) * 0.3)
    six[:, 1] = 0.0
    assert dead(six) == []


def test_beside_axes_that_jump_once_it_may_only_not_be_turned() -> None:
    six = np.zeros((50, 6))
    six[10:, [0, 2, 3, 4, 5]] = 1.0
    assert dead(six) == []


def test_others_of_its_sensor_still_tell_of_rest() -> None:
    six = np.random.default_rng(2).normal(size=(50, 6))
    six[:, 5] = 0.0
    block = block_of(six)
    told = without_dead_axes(block, dead(six)).six
    assert np.isnan(told[:, 5]).all()
    np.testing.assert_array_equal(told[:, :5], six[:, :5])
    assert (block.gyr[:, 2] == 0).all()
    assert without_dead_axes(block, []) is block


@pytest.mark.parametrize("value", [0.0, 9.81, np.nan])
def test_a_sensor_goes_with_one_axis(value: float) -> None:
    six = np.random.default_rng(0).normal(size=(50, 6))
    six[:, 2] = value
    six[3, 4] = np.nan
    (found,) = dead(six)
    assert (found.channels, found.absent) == (ACC, False)
    assert found.message.endswith("not used: az never changes, or is missing")


def test_a_sensor_that_sends_zeros_is_absent_and_one_not_recorded_is_none() -> None:
    six = np.random.default_rng(0).normal(size=(50, 6))
    six[:, :3], six[:, 3:] = np.nan, 0.0
    (found,) = dead(six)
    assert (found.channels, found.absent) == (GYR, True)
    assert "gx, gy and gz never change, or are missing" in found.message


def test_rows_of_either_sensor_in_turn_are_both_alive() -> None:
    six = np.random.default_rng(3).normal(size=(60, 6))
    six[::2, :3] = six[1::2, 3:] = np.nan
    assert dead(six) == []
    six[1::2, 0] = 0.5
    (found,) = dead(six)
    assert found.axes == (0,)


def test_an_axis_that_never_changes_beside_others_that_do_is_a_broken_one() -> None:
    six = np.random.default_rng(4).normal(size=(50, 6))
    assert broken_axis_messages(block_of(six)) == []
    six[:, 1] = 0.3
    (said,) = broken_axis_messages(block_of(six))
    assert said.startswith("ay never changes while the rest of the sensor does")
    six[:, 0], six[4, 0] = 0.1, np.nan
    (said,) = broken_axis_messages(block_of(six))
    assert said.startswith("ax and ay never change while")
    # a column that is missing was not recorded, and a sensor of zeros is not there
    six[:, :2], six[:, 3:] = np.nan, 0.0
    assert broken_axis_messages(block_of(six)) == []


def test_cells_of_an_axis_that_never_changes_are_as_if_not_recorded() -> None:
    """And of the others as they are, in every part of a long recording."""
    rows = np.random.default_rng(5).normal(size=(5000, 35))
    rows[:, 27:33] = np.nan
    rows[100, 27] = rows[4900, [28, 30, 31, 32]] = 1e-3
    alive = LiveAxisRows(rows)
    assert len(alive) == 5000
    found, expected = alive[10:4950], rows[10:4950].copy()
    expected[:, [1 + 2, 7 + 2, 13 + 2, 19 + 2]] = 0.0
    np.testing.assert_array_equal(found, expected)
    assert (rows[:, 3] != 0).all()

    t = np.arange(4.0)
    block = Block.of(t, np.ones((4, 3)), np.ones((4, 3)))
    (seen,) = alive.samples_without_dead_axes(lambda start, end: iter([block]))(
        0.0, 4.0
    )
    assert seen.acc.shape == seen.gyr.shape == (4, 3)
    assert np.isnan(seen.acc[:, 2]).all() and (seen.acc[:, :2] == 1).all()
    assert (seen.gyr == 1).all() and (block.acc == 1).all()


def test_where_nothing_changes_everything_is_looked_at() -> None:
    rows = np.ones((10, 35))
    rows[:, 27:33] = np.nan
    alive = LiveAxisRows(rows)
    np.testing.assert_array_equal(alive[:], rows)
    nothing = iter(())
    assert (
        alive.samples_without_dead_axes(lambda start, end: nothing)(0.0, 1.0) is nothing
    )


def test_the_share_of_changes_is_that_of_neighbours_that_were_measured() -> None:
    """A lost value parts nothing; one value never changed, and none is not known."""
    nan = np.nan
    for values, share in (
        ([1.0, 1.0, 2.0, nan, 2.0, 1.0], 2 / 4), ([3.0], 0.0), ([nan, 3.0], 0.0),
    ):  # fmt: skip
        assert dead_axis._share_of_changes(np.array(values)) == pytest.approx(share)
    assert np.isnan(dead_axis._share_of_changes(np.array([nan])))
