"""The force of positions whose angles nobody knows."""

from __future__ import annotations

import numpy as np

from fieldcal.core.positions import Position
from fieldcal.core.samples import Array
from fieldcal.model.rows.orientation import force_along_mean
from fieldcal.model.rows.turntable import GyroReadings


def test_a_free_force_is_one_for_all_rows_of_a_position() -> None:
    f = np.array([[3.0, 0.0, 4.1], [3.0, 0.0, 3.9], [0.0, -2.0, 0.0], [0.0] * 3])
    position = np.array([0, 0, 1, 2])
    found: Array = force_along_mean(10.0, position, f)
    expected = [[6.0, 0.0, 8.0]] * 2 + [[0.0, -10.0, 0.0], [0.0] * 3]
    np.testing.assert_allclose(found, expected, atol=1e-12)
    f[0, 1] = np.nan
    np.testing.assert_allclose(
        force_along_mean(10.0, position, f), expected, atol=1e-12
    )


def test_rows_in_which_an_axis_is_missing_do_not_turn_the_force() -> None:
    f = np.tile([2.0, -6.0, 3.0], (4, 1))
    f[:3, 1] = np.nan
    found: Array = force_along_mean(7.0, np.zeros(4, int), f)
    np.testing.assert_allclose(found, np.tile([2.0, -6.0, 3.0], (4, 1)))
    f[3, 1] = np.nan  # nothing is known of it
    found = force_along_mean(np.sqrt(13.0), np.zeros(4, int), f)
    np.testing.assert_allclose(found, np.tile([2.0, 0.0, 3.0], (4, 1)))


def test_rows_in_which_an_axis_is_missing_do_not_turn_the_rate_of_a_table() -> None:
    w = np.tile([0.2, -0.6, 0.3], (4, 1))
    w[:3, 1] = np.nan
    table = (Position("any", speed=1.4),)
    rates = GyroReadings(table, np.zeros(4, int), w).rates(np.eye(3))
    np.testing.assert_allclose(rates, np.tile([0.4, -1.2, 0.6], (4, 1)))
