"""Axes that tell nothing all through a recording."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import ACC, GYR
from fieldcal.windows.dead_axis import dead_sensors, without_dead


def test_an_axis_that_changes_once_is_not_dead() -> None:
    six = np.zeros((50, 6))
    six[30] = 1e-9
    assert dead_sensors(six) == []


def test_beside_axes_as_coarse_it_may_only_not_be_turned() -> None:
    six = np.round(np.random.default_rng(2).normal(size=(500, 6)) * 0.3)
    six[:, 1] = 0.0
    assert dead_sensors(six) == []
    np.testing.assert_array_equal(without_dead(six), six)


def test_others_of_its_sensor_still_tell_of_rest() -> None:
    six = np.random.default_rng(2).normal(size=(50, 6))
    six[:, 5] = 0.0
    told = without_dead(six)
    assert np.isnan(told[:, 5]).all()
    np.testing.assert_array_equal(told[:, :5], six[:, :5])
    assert (six[:, 5] == 0).all()


@pytest.mark.parametrize("value", [0.0, 9.81, np.nan])
def test_a_sensor_goes_with_one_axis(value: float) -> None:
    six = np.random.default_rng(0).normal(size=(50, 6))
    six[:, 2] = value
    six[3, 4] = np.nan
    (found,) = dead_sensors(six)
    assert (found.channels, found.absent) == (ACC, False)
    assert found.says.endswith("not used: az never changes, or is missing")


def test_a_sensor_that_sends_zeros_is_absent_and_one_not_recorded_is_none() -> None:
    six = np.random.default_rng(0).normal(size=(50, 6))
    six[:, :3], six[:, 3:] = np.nan, 0.0
    (found,) = dead_sensors(six)
    assert (found.channels, found.absent) == (GYR, True)
    assert "gx, gy and gz never change, or are missing" in found.says


def test_rows_of_either_sensor_in_turn_are_both_alive() -> None:
    six = np.random.default_rng(3).normal(size=(60, 6))
    six[::2, :3] = six[1::2, 3:] = np.nan
    assert dead_sensors(six) == []
    six[1::2, 0] = 0.5
    (found,) = dead_sensors(six)
    assert found.axes == (0,)
