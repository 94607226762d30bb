"""Rows of means: one for each window, against vectors turned one by one."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from observed import carried, observe, outputs

from fieldcal.calibration import Nominal
from fieldcal.core.base_motion import BaseMotion
from fieldcal.core.positions import FIVE_POSITIONS, Position
from fieldcal.core.samples import Array
from fieldcal.model.rows.turntable import unknown_earth_rate
from fieldcal.solve.observation_rows import (
    mean_variances,
    rows_of_observations,
    with_window_variances,
    without_angles,
)
from fieldcal.solve.observations import Observations

G, EARTH = 9.8, 7.292115e-5
HAND = Position("by hand", sigma=0.02)
TABLE = Position("on the table", rate=(0.0, 0.0, 0.5))
KNOWN = Position.deg(30.0, 10.0)
MOUNTING = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
NOMINAL = Nominal((0.1, 0.2, -0.3), (2.0, 4.0, 5.0), (1e-3, 2e-3, 0.0), (1.0, 2.0, 1.0))


def seen(positions: tuple[Position, ...], **known: Any) -> Observations:
    mean = np.array([[1.0, -9.6, 2.0, 1e-3, -2e-3, 5e-4]] * len(positions))
    return observe(positions, mean[:, :3], gyr=mean[:, 3:], gravity=G, **known)


def test_there_is_one_row_for_each_window() -> None:
    three = (KNOWN, HAND, TABLE)
    one = rows_of_observations(seen(three, time=np.array([5.0, 12.0, 25.0])))
    rows = one.rows
    assert rows.x.position.tolist() == [0, 1, 2]
    assert rows.x.t.tolist() == [5.0, 12.0, 25.0]
    assert rows.x.since_start.tolist() == [0.0, 7.0, 20.0]
    assert rows.span.tolist() == [[5.0, 5.0], [12.0, 12.0], [25.0, 25.0]]
    np.testing.assert_array_equal(rows.y, seen(three).mean)
    np.testing.assert_array_equal(rows.x.attitude_sigma, [np.nan, 0.02, np.nan])
    assert rows.x.gamma.tolist() == [0.0] * 3
    assert one.since_turn.tolist() == [[np.inf] * 3] and one.source is None
    assert rows.length.tolist() == [1.0] * 3
    assert len(rows.hand_angle) == 3 and not rows.hand_angle.any()


def test_noise_is_that_of_the_means() -> None:
    rows = rows_of_observations(seen(FIVE_POSITIONS)).rows
    np.testing.assert_allclose(rows.sd, [[1e-3] * 3 + [2e-5] * 3] * 5)
    np.testing.assert_allclose(rows.noise, [1e-3] * 3 + [2e-5] * 3)
    assert not rows.window_error.any()
    one = seen(FIVE_POSITIONS)
    one.covariance[1, 4, 4] = 0.0
    assert np.isnan(rows_of_observations(one).rows.sd[1, 4])


def test_force_and_rate_are_those_of_the_device_axes() -> None:
    moving = BaseMotion(np.array([1e-6, 2e-6, 3e-6]), np.array([0.01, 0.5, -0.02]))
    turning = replace(KNOWN, rate=(0.1, 0.2, 0.3))
    x = rows_of_observations(
        seen((KNOWN, turning), mounting=MOUNTING, base_motion=moving, latitude=0.7)
    ).rows.x
    alpha, beta = np.deg2rad([30.0, 10.0])
    # the vertical part of the force is in the gravity of the site
    felt = MOUNTING.T @ carried(alpha, beta, [0.01, -G, -0.02])
    np.testing.assert_allclose(x.f, np.tile(felt, (2, 1)), atol=1e-12)
    np.testing.assert_array_equal(x.base_force, [0.01, -G, -0.02])
    np.testing.assert_array_equal(x.transport, moving.rate)
    assert x.rate.tolist() == [[0.0] * 3, [0.1, 0.2, 0.3]]
    turns = MOUNTING.T @ np.array([0.1, 0.2, 0.3])
    np.testing.assert_allclose(x.w[1], turns, atol=1e-5)
    assert x.latitude == 0.7
    assert np.isnan(rows_of_observations(seen((KNOWN,))).rows.x.latitude)


def test_a_force_of_unknown_direction_is_along_the_measured_one() -> None:
    x = rows_of_observations(seen((HAND, KNOWN), nominal=NOMINAL)).rows.x
    along = (np.array([1.0, -9.6, 2.0]) - [0.1, 0.2, -0.3]) / [2.0, 4.0, 5.0]
    np.testing.assert_allclose(x.f[0], G * along / np.linalg.norm(along))
    alpha, beta = np.deg2rad([30.0, 10.0])
    np.testing.assert_allclose(x.f[1], carried(alpha, beta, [0, -G, 0]))


def test_unseen_earth_is_an_error_of_windows_that_share_a_bias() -> None:
    """Its mean square about each axis, over all directions, is a third of its own."""
    every = np.random.default_rng(7).standard_normal((100_000, 3))
    every *= EARTH / np.linalg.norm(every, axis=1, keepdims=True)
    error = unknown_earth_rate((1.0, -2.0, 4.0))
    sizes = np.array([1.0, 2.0, 4.0])
    np.testing.assert_allclose(error, (sizes * every).std(axis=0), rtol=0.01)
    two = rows_of_observations(seen((HAND, HAND), nominal=NOMINAL))
    expected = EARTH / np.sqrt(3) * np.array([1.0, 2.0, 1.0])
    np.testing.assert_allclose(two.rows.window_error[:, 3:], np.tile(expected, (2, 1)))
    assert not two.rows.window_error[:, :3].any()
    assert not rows_of_observations(seen((HAND,))).rows.window_error.any()


def test_by_hand_the_variance_along_the_force_counts_for_all_axes() -> None:
    one = observe([KNOWN, HAND], np.array([[0.0, -9.8, 0], [3.0, 0.0, -4.0]]))
    root = np.random.default_rng(3).standard_normal((2, 3, 3))
    one.covariance[:, :3, :3] = root @ np.swapaxes(root, 1, 2)
    found = mean_variances(one)
    diagonals = np.array([np.diag(c) for c in one.covariance])
    np.testing.assert_allclose(found[0], diagonals[0])
    up = np.array([0.6, 0.0, -0.8])
    np.testing.assert_allclose(found[1, :3], up @ one.covariance[1, :3, :3] @ up)
    np.testing.assert_allclose(found[1, 3:], diagonals[1, 3:])
    one.mean[1, 0] = np.nan
    np.testing.assert_allclose(mean_variances(one), diagonals)


def test_without_angles_forces_are_the_measured_ones_unless_a_table_turns() -> None:
    rows = rows_of_observations(
        seen((KNOWN, HAND, replace(KNOWN, rate=(0.0, 0.2, 0.0))))
    ).rows
    rows.y[1, 1] = np.nan
    found = without_angles(rows, NOMINAL)
    assert np.isnan(found.x.alpha).all() and np.isnan(found.x.beta).all()
    along = (np.array([1.0, -9.6, 2.0]) - [0.1, 0.2, -0.3]) / [2.0, 4.0, 5.0]
    np.testing.assert_allclose(found.x.f[0], G * along / np.linalg.norm(along))
    np.testing.assert_array_equal(found.x.f[1:], rows.x.f[1:])


def one_window(sd: Array, error: Array) -> Any:
    rows = rows_of_observations(seen((KNOWN, KNOWN, KNOWN, KNOWN))).rows
    x = replace(rows.x, position=np.array([0, 0, 1, 1]))
    return replace(rows, x=x, sd=sd, window_error=error)


def test_variance_beyond_white_noise_is_an_error_of_the_window() -> None:
    """Two rows of sd 2 and 1 have a mean of variance 1 / (1 / 4 + 1) = 0.8."""
    sd = np.tile([[2.0], [1.0]], (2, 6))
    rows = one_window(sd, np.zeros((4, 6)))
    rows.window_error[2:, 5] = 4.0
    known = np.full((2, 6), 0.8 + 0.09)
    known[0, 1], known[0, 2] = 0.5, np.nan
    found = with_window_variances(rows, known)
    expected = np.full((4, 6), 0.3)
    expected[:2, 1:3], expected[2:, 5] = 0.0, 4.0
    np.testing.assert_allclose(found.window_error, expected, atol=1e-12)
    assert not rows.window_error[:2].any(), "the rows given are not changed"


def test_rows_that_are_not_used_take_no_part_in_the_white_noise() -> None:
    sd = np.tile([[2.0], [np.nan]], (2, 6))
    found = with_window_variances(
        one_window(sd, np.zeros((4, 6))), np.full((2, 6), 5.0)
    )
    np.testing.assert_allclose(found.window_error, 1.0)


@pytest.mark.parametrize("latitude", [None, 0.9])
def test_gyroscopes_that_see_the_earth_have_its_length_for_their_rate(
    latitude: float | None,
) -> None:
    """Of the navigation grade; under way that of the base is added."""
    many = tuple(Position(f"{i}") for i in range(8))
    turns = np.random.default_rng(2).standard_normal((8, 3))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    base = BaseMotion(np.array([0.0, -3e-5, 2e-5]), np.zeros(3))
    length = EARTH
    if latitude is not None:
        length = np.hypot(
            EARTH * np.sin(latitude) + 3e-5, EARTH * np.cos(latitude) + 2e-5
        )
    one = observe(
        many, outputs([KNOWN] * 8), gyr=length * turns, sigma_gyr=1e-9,
        latitude=latitude, grade="navigation", base_motion=base,
    )  # fmt: skip
    x = rows_of_observations(one).rows.x
    np.testing.assert_allclose(x.w, length * turns, rtol=1e-3, atol=1e-8)
    plain = rows_of_observations(replace(one, grade="tactical")).rows.x
    assert not plain.w.any()
