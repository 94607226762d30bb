"""The force of positions whose angles nobody knows."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model.rows.orientation import force_along_mean


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
