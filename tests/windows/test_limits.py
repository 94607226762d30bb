"""Bounds of sanity, channel by channel."""

import numpy as np

from fieldcal.windows.limits import StillnessLimits


def test_each_channel_has_the_bound_of_its_sensor() -> None:
    limits = StillnessLimits(acc=1.0, gyr=2.0, acc_drift=3.0, gyr_drift=4.0)
    np.testing.assert_array_equal(limits.noise, [1, 1, 1, 2, 2, 2])
    np.testing.assert_array_equal(limits.drift, [3, 3, 3, 4, 4, 4])


def test_a_running_engine_is_within_and_a_walk_is_not() -> None:
    limits = StillnessLimits()
    assert (limits.noise[:3] > 0.2).all() and (limits.noise[:3] < 1.0).all()
    assert (limits.drift < limits.noise).all() and (limits.drift > 0).all()


def test_on_a_base_that_sways_what_it_turns_by_is_no_drift() -> None:
    still, swaying = StillnessLimits(), StillnessLimits.swaying()
    np.testing.assert_array_equal(swaying.noise, still.noise)
    np.testing.assert_array_equal(swaying.drift, 2 * still.noise)
    assert swaying.unjudged_s == 16.0
