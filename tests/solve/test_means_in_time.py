"""When means were taken: rows of means, of which nobody has the samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from observed import observe, outputs

from fieldcal.core.positions import FIVE_POSITIONS
from fieldcal.core.samples import Array
from fieldcal.physics.experience import Experience
from fieldcal.solve.observation_rows import rows_of_observations

MINUTES = 60.0 * np.array([3.0, 1.0, 2.0, 5.0, 8.0])


def inputs(time: Array) -> Experience:
    seen = observe(FIVE_POSITIONS, outputs(FIVE_POSITIONS))
    return rows_of_observations(replace(seen, time=time)).rows.x


def test_times_count_from_the_earliest_window() -> None:
    """A device that drifts for minutes is not taken to drift for seconds."""
    x = inputs(MINUTES)
    np.testing.assert_array_equal(x.t, MINUTES)
    np.testing.assert_array_equal(x.since_start, [120.0, 0.0, 60.0, 240.0, 420.0])


@pytest.mark.parametrize("unknown", [slice(None), slice(3, 4)])
def test_of_means_of_which_one_has_no_time_none_is_later(unknown: slice) -> None:
    """Neither by a second each, which nobody measured, nor by what the others are."""
    time = MINUTES.copy()
    time[unknown] = np.nan
    x = inputs(time)
    assert not x.t.any() and not x.since_start.any()
