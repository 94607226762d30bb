"""Windows as estimators are given them: what fits together, and what cannot be."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from observed import observe, outputs
from test_result import observed

from fieldcal.calibration import Nominal
from fieldcal.core.base_motion import BaseMotion
from fieldcal.core.errors import InputError
from fieldcal.core.positions import FIVE_POSITIONS, Position
from fieldcal.solve import observations
from fieldcal.solve.observations import Observations
from fieldcal.windows import Average


def test_correlations_that_a_window_is_too_short_to_know_are_dropped() -> None:
    size = np.array([1.0, 2.0, 3.0, 1e-3, 2e-3, 3e-3])
    alike = np.full((6, 6), 0.5) + 0.5 * np.eye(6)
    kept = alike * np.outer(size, size)
    np.testing.assert_array_equal(observations._regularised(kept), kept)
    one = alike.copy()
    one[0, 1] = one[1, 0] = 1.0
    one[0, 2] = one[1, 2] = one[2, 0] = one[2, 1] = 0.5
    singular = one * np.outer(size, size)
    found = observations._regularised(singular)
    np.testing.assert_allclose(found[:3, :3], np.diag(size[:3] ** 2))
    np.testing.assert_array_equal(found[3:, 3:], singular[3:, 3:])
    assert not found[:3, 3:].any() and not found[3:, :3].any()
    nowhere = kept.copy()
    nowhere[3:, :] = nowhere[:, 3:] = np.nan
    np.testing.assert_array_equal(observations._regularised(nowhere), nowhere)
    still = kept.copy()
    still[1, :] = still[:, 1] = 0.0
    np.testing.assert_array_equal(observations._regularised(still), still)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"gravity": 0.0}, "gravity is 0 m/s^2: give the local value, about 9.8, or the"
         " latitude and height of the site"),
        ({"mean": np.zeros((5, 5))}, "mean is (5, 5) where 5 positions need (5, 6)"),
        ({"time": np.zeros(4)}, "time is (4,) where 5 positions need (5,)"),
        ({"covariance": np.zeros((5, 6, 6))}, "the accelerometers' means have no"
         " uncertainty above 0 m/s^2: a window of repeated equal values tells nothing"
         " about its noise; record with more digits"),
    ],
)  # fmt: skip
def test_observations_that_cannot_be_are_refused(
    change: dict[str, Any], says: str
) -> None:
    seen = observed()
    known: dict[str, Any] = {"positions": seen.positions, "mean": seen.mean,
                             "covariance": seen.covariance, "gravity": 9.8}  # fmt: skip
    with pytest.raises(InputError) as error:
        Observations(**(known | change))
    assert str(error.value) == says


def test_a_mean_that_is_missing_is_named() -> None:
    seen = observed()
    mean = seen.mean.copy()
    mean[3, 4] = np.nan
    with pytest.raises(InputError) as error:
        Observations(seen.positions, mean, seen.covariance, 9.8)
    assert str(error.value) == (
        f"position 4 ({FIVE_POSITIONS[3].name}) has no mean of gy: take its window"
        " again or leave it out"
    )
    with pytest.raises(InputError, match="there is no position with a window: take at"):
        Observations.of((), (), 9.8)
    with pytest.raises(InputError, match="the latitude is not known, so the Earth's"):
        _ = seen.known_latitude
    assert observed(latitude=0.7).known_latitude == 0.7


def test_of_some_positions_everything_is_theirs() -> None:
    seen = observed(temperature=np.arange(5.0), time=10 * np.arange(5.0))
    some = seen[[3, 1]]
    assert [p.name for p in some.positions] == [
        FIVE_POSITIONS[3].name,
        FIVE_POSITIONS[1].name,
    ]
    np.testing.assert_array_equal(some.mean, seen.mean[[3, 1]])
    np.testing.assert_array_equal(some.temperature, [3.0, 1.0])
    np.testing.assert_array_equal(some.time, [30.0, 10.0])
    assert len(some.covariance) == 2 and len(some) == 2


def average(size: float, start: float, end: float) -> Average:
    covariance = size * np.diag([1.0, 2, 3, 4, 5, 6])
    return Average(size * np.arange(1.0, 7.0), covariance, 20 + size, 9, start, end)


def test_averages_are_gathered_with_what_is_known() -> None:
    windows = [average(1.0, 2.0, 6.0), average(2.0, 10.0, 30.0)]
    places = FIVE_POSITIONS[:2]
    plain = Observations.of(places, windows, 9.8)
    assert plain.positions == places and plain.gravity == 9.8
    np.testing.assert_array_equal(
        plain.mean, [[1, 2, 3, 4, 5, 6], [2, 4, 6, 8, 10, 12]]
    )
    np.testing.assert_array_equal(plain.covariance, [w.covariance for w in windows])
    assert plain.temperature.tolist() == [21.0, 22.0]
    assert plain.time.tolist() == [4.0, 20.0], "the middle of each"
    assert plain.latitude is None and plain.grade == "tactical"
    np.testing.assert_array_equal(plain.mounting, np.eye(3))
    assert plain.nominal == Nominal() and not plain.base_motion.rate.any()
    mounting = np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])
    nominal, base = Nominal((1.0, 2.0, 3.0)), BaseMotion(np.ones(3), np.ones(3))
    known = Observations.of(
        places, windows, 9.8, latitude=0.5, mounting=mounting, grade="navigation",
        nominal=nominal, base_motion=base,
    )  # fmt: skip
    assert known.latitude == 0.5 and known.grade == "navigation"
    assert known.mounting is mounting
    assert known.nominal is nominal and known.base_motion is base


def test_vectors_are_in_device_axes() -> None:
    """x of the device lies along y of the procedure, y along z, and z along x."""
    mounting = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    table = Position("table", 0.0, 0.0, rate=(0.1, 0.2, 0.3))
    seen = observe([table], np.zeros((1, 3)), mounting=mounting, gravity=9.5)
    np.testing.assert_allclose(seen.rates, [[0.2, 0.3, 0.1]])
    np.testing.assert_allclose(seen.forces, [[-9.5, 0, 0]], atol=1e-12)
    assert seen.rotating.tolist() == [True] and seen.oriented.tolist() == [True]
    assert observe([Position("hand")], np.zeros((1, 3))).oriented.tolist() == [False]


def test_sensors_are_there_where_they_were_measured() -> None:
    table = Position("table", 0.0, 0.0, rate=(0.0, 0.0, 0.3))
    places = (*FIVE_POSITIONS[:2], table)
    acc = np.vstack([outputs(FIVE_POSITIONS[:2]), np.full((1, 3), np.nan)])
    seen = observe(places, acc)
    assert seen.has_acc and not seen.has_gyr
    only = observe((table,), acc[2:], gyr=np.zeros((1, 3)))
    assert not only.has_acc and only.has_gyr
    none = observe(FIVE_POSITIONS[:1], acc[2:], gyr=np.zeros((1, 3)))
    assert not none.has_acc and none.has_gyr
    assert observed().has_acc and observed().has_gyr and not observed(gyr=False).has_gyr


@pytest.mark.parametrize("gravity", [-9.8, 0.0, np.nan, np.inf])
def test_gravity_is_positive_and_known(gravity: float) -> None:
    with pytest.raises(InputError, match=f"^gravity is {gravity:g} m/s"):
        observed(gravity=gravity)


def test_no_position_and_gyroscopes_without_noise_are_refused() -> None:
    with pytest.raises(InputError) as error:
        Observations((), np.zeros((0, 6)), np.zeros((0, 6, 6)), 9.8)
    assert str(error.value) == "there is no position: mark at least two"
    with pytest.raises(InputError) as error:
        observe(FIVE_POSITIONS, outputs(FIVE_POSITIONS), gyr=np.full((5, 3), 0.01),
                sigma_gyr=0.0)  # fmt: skip
    assert str(error.value) == (
        "the gyroscopes' means have no uncertainty above 0 rad/s: a window of repeated"
        " equal values tells nothing about its noise; record with more digits"
    )
    gated = np.full((5, 3), 0.01) * [1.0, 1.0, 0.0]
    with pytest.raises(
        InputError,
        match=r"^the gyroscopes read 0 rad/s in every "
        r"sample at rest: .*; switch this off \(.*\) and record again$",
    ):
        observe(FIVE_POSITIONS, outputs(FIVE_POSITIONS), gyr=gated, sigma_gyr=0.0)


def test_a_mean_that_is_missing_on_a_table_is_named_by_its_position() -> None:
    table = Position("table", 0.0, 0.0, rate=(0.0, 0.0, 0.3))
    acc = outputs(FIVE_POSITIONS[:3])
    acc[2, 2] = np.nan
    places = (table, *FIVE_POSITIONS[1:3])
    with pytest.raises(InputError, match=r"^position 3 \(α = 22.5°, β = 2.5°\) has no "
                       "mean of az: "):  # fmt: skip
        observe(places, acc)
    acc[2, 2], acc[0, 1] = 0.0, np.nan
    assert observe(places, acc).has_acc
