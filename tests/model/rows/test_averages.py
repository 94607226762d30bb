"""Averages of samples between bounds that are given."""

from __future__ import annotations

import numpy as np
from still_samples import about, place, samples, source

from fieldcal.model.rows.averages import average_rows


def test_averages_between_any_bounds() -> None:
    block = samples(10.0)
    one = source(block, about(place(2.0, 5.0), place(6.0, 12.0)))
    bound = np.array([[10, 20], [20, 60], [200, 204]])
    level, noise = np.full((3, 6), 2.0), np.full(6, 7.0)
    variance = np.arange(9.0).reshape(3, 3)
    rows = average_rows(one, bound, np.array([0, 0, 1]), level, noise, variance)
    for i, (a, b) in enumerate(bound):
        np.testing.assert_allclose(rows.y[i], block.six[a:b].mean(axis=0), atol=1e-12)
        np.testing.assert_allclose(rows.sd[i], 2.0 / np.sqrt(b - a))
    np.testing.assert_allclose(rows.length, [0.2, 0.8, 0.08])
    np.testing.assert_array_equal(rows.noise, noise)
    np.testing.assert_array_equal(rows.x.variance, variance)
    assert not rows.window_error.any()
