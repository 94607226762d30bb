"""Rows of tables of means, of which nobody has the samples."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import Block
from fieldcal.model.rows.averages import Rows
from fieldcal.model.rows.reduce import median_sigma, rows_of_means
from fieldcal.model.rows.row_source import RowSource
from fieldcal.model.rows.thermometer import Thermometer
from fieldcal.session.description_file import parse_description

G = 9.8
MEANS = np.array([
    [0.1, -9.8, 0.0, 1e-3, 0.0, 0.0],
    [-9.7, 0.0, 0.1, 0.0, 2e-3, 0.0],
    [0.0, 6.0, 8.0, 0.0, 0.0, 3e-3],
])  # fmt: skip
SIGMA = np.array([[0.01] * 3 + [1e-4] * 3, [0.02] * 3 + [np.nan] * 3, [0.03] * 6])


def rows(timed: bool, known: int = 2, places: int = 3) -> Rows:
    """Means at 10, 20 and 30 s; the orientation of the last is not known."""
    positions: list[dict[str, Any]] = [
        {"start_s": 10.0 * i + 9.5, "end_s": 10.0 * i + 10.5}
        | ({"alpha_deg": 90.0 * i, "beta_deg": 0.0} if i < known else {})
        for i in range(places)
    ]
    about = parse_description({
        "format": 1, "site": {"gravity": G}, "position": positions,
        "means": {"timed": timed}, "nominal": {"gyr_scale": [1.0, -2.0, 1.0]},
    })  # fmt: skip
    t = np.array([10.0, 20.0, 30.0])[:places]
    block = Block.of(t, MEANS[:places, :3], MEANS[:places, 3:])
    usable, arrived = np.ones((places, 6), dtype=bool), np.zeros(places)
    source = RowSource(block, about, usable, arrived, Thermometer.of(block))
    return rows_of_means(source, SIGMA[:places])


def test_each_mean_is_a_row_with_the_noise_that_is_stated() -> None:
    found = rows(True)
    np.testing.assert_allclose(found.y, MEANS, atol=1e-12)
    np.testing.assert_array_equal(found.sd, SIGMA)
    assert found.x.position.tolist() == [0, 1, 2]
    np.testing.assert_allclose(found.noise, [0.02] * 3 + [0.01505] * 3)
    np.testing.assert_allclose(found.x.f[1:], [[-G, 0, 0], [0, 0.6 * G, 0.8 * G]],
                               atol=1e-12)  # fmt: skip
    assert not found.x.variance.any()


def test_of_means_that_nobody_timed_none_is_later() -> None:
    found = rows(True)
    np.testing.assert_array_equal(found.x.t, [10.0, 20.0, 30.0])
    np.testing.assert_array_equal(found.x.since_start, [0.0, 10.0, 20.0])
    untimed = rows(False)
    assert not untimed.x.t.any() and not untimed.x.since_start.any()
    for one in (found, untimed):
        assert np.isposinf(one.x.since_turn).all()


def test_the_earth_turns_a_device_of_unknown_orientation() -> None:
    common = rows(True).window_error
    earth = EARTH_RATE / 3**0.5 * np.array([1.0, 2.0, 1.0])
    np.testing.assert_allclose(common[2], [0.0] * 3 + earth.tolist())
    assert not common[:2].any()
    assert not rows(True, known=0, places=1).window_error.any(), (
        "it is in the bias of one"
    )


def test_the_median_is_that_of_what_is_known() -> None:
    sigma = np.array([[1.0, np.nan], [3.0, np.nan], [np.nan, np.nan], [8.0, np.nan]])
    found = median_sigma(sigma)
    assert found[0] == pytest.approx(3.0) and np.isnan(found[1])
