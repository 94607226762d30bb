"""What of the Earth's rate goes round with a table, of rates that are written out."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.rotation import rotation_matrices
from fieldcal.core.samples import Array
from fieldcal.model.rows import turntable
from fieldcal.model.rows.turntable import fit_rotating_earth_rate

AXIS = np.array([1.0, 2.0, -2.0]) / 3.0
SPEED = 0.5
BIAS = np.array([0.01, -0.02, 0.03])
SCALE = np.array([1.0, 0.9, 1.1])
EARTH = EARTH_RATE * np.array([0.6, 0.0, 0.8])
SD = 1e-7


def outputs(t: Array, length: float) -> tuple[Array, Array]:
    """Means over `length` s, and what of them lies across the axis and goes round."""
    fine = t[:, None] + length * (np.arange(200) + 0.5) / 200 - length / 2
    turned = rotation_matrices(-SPEED * fine[..., None] * AXIS) @ EARTH
    across = turned - (turned @ AXIS)[..., None] * AXIS
    round_: Array = SCALE * across.mean(axis=1)
    return BIAS + SCALE * (SPEED * AXIS + AXIS * (EARTH @ AXIS)) + round_, round_


@pytest.mark.parametrize("length", [0.0, 1.0, 3.0])
def test_it_is_found_beside_the_mean(length: float) -> None:
    t = 5.0 + np.arange(0.0, 30.0, 1.0)
    gyr, round_ = outputs(t, length)
    found = fit_rotating_earth_rate(
        t, SPEED * AXIS, gyr, np.full((30, 3), SD), SCALE, length
    )
    np.testing.assert_allclose(found.values, round_, atol=2e-9)
    assert np.abs(round_).max() > 2e-5


def test_its_uncertainty_is_that_of_the_mean_that_is_left() -> None:
    """Of white noise, against many draws."""
    t = np.arange(0.0, 15.0, 1.0)
    gyr, round_ = outputs(t, 1.0)
    rng, sd = np.random.default_rng(1), np.full((15, 3), 2e-6) * [1.0, 2.0, 0.5]
    off = []
    for _ in range(1000):
        noisy = gyr + sd * rng.standard_normal(gyr.shape)
        found = fit_rotating_earth_rate(t, SPEED * AXIS, noisy, sd, SCALE, np.ones(15))
        off.append((found.values - round_).mean(axis=0))
    spread = np.cov(np.array(off).T)
    size = np.sqrt(np.diag(found.covariance))
    np.testing.assert_allclose(
        spread / np.outer(size, size), found.covariance / np.outer(size, size), atol=0.2
    )


def test_rows_that_are_missing_are_not_asked() -> None:
    t = np.arange(0.0, 30.0, 1.0)
    gyr, round_ = outputs(t, 1.0)
    sd = np.full((30, 3), SD)
    gyr[4, 1], sd[9, 2] = np.nan, np.nan
    gyr[9] += 1.0
    found = fit_rotating_earth_rate(t, SPEED * AXIS, gyr, sd, SCALE, 1.0)
    np.testing.assert_allclose(found.values, round_, atol=2e-9)
    gyr[2:] = np.nan
    assert not fit_rotating_earth_rate(
        t, SPEED * AXIS, gyr, sd, SCALE, 1.0
    ).values.any()


@pytest.mark.parametrize("times", [1.5, 1.0, 0.5])
def test_what_is_larger_than_the_earth_makes_stays(times: float) -> None:
    t = np.arange(0.0, 30.0, 1.0)
    gyr, round_ = outputs(t, 1.0)
    size = np.linalg.norm(EARTH - AXIS * (EARTH @ AXIS))
    gyr += (times * EARTH_RATE / size - 1.0) * round_
    found = fit_rotating_earth_rate(
        t, SPEED * AXIS, gyr, np.full((30, 3), SD), SCALE, 1.0
    )
    assert found.values.any() == (times <= 1.0)


@pytest.mark.parametrize(("seconds", "share"), [(12.0, 1 / 36.0), (2.0, 0.5)])
def test_of_less_than_a_turn_the_mean_keeps_what_nobody_can_tell(
    seconds: float, share: float
) -> None:
    """(2): none of it along the axis, whatever the direction across."""
    t = np.linspace(0.0, seconds, 20)
    gyr, _ = outputs(t, 0.1)
    found = fit_rotating_earth_rate(
        t, SPEED * AXIS, gyr, np.full((20, 3), SD), SCALE, 0.1
    )
    assert not found.values.any()
    size = 2 / 3 * EARTH_RATE**2 * share
    expected = size * (np.eye(3) - np.outer(AXIS, AXIS))
    np.testing.assert_allclose(found.covariance, expected, rtol=1e-9)


def test_a_bias_is_what_makes_rates_of_known_lengths() -> None:
    """Of eight positions in which the Earth's rate points anywhere, and of a table."""
    rng = np.random.default_rng(4)
    along = rng.normal(size=(8, 3))
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    for bias, length in (
        (1e-2 * BIAS, np.full(8, EARTH_RATE)),
        (BIAS, np.linspace(0.2, 0.7, 8)),
    ):
        rates = bias + along * length[:, None]
        found, known = turntable._bias_from_norms(rates, length)
        assert known
        np.testing.assert_allclose(found, bias, rtol=1e-6)
    few, known = turntable._bias_from_norms(rates[:3], length[:3])
    assert not known and not few.any()
    level = along * [1.0, 1.0, 0.0]
    flat, known = turntable._bias_from_norms(
        BIAS + level, np.linalg.norm(level, axis=1)
    )
    assert not known and not flat.any(), "nothing about the third axis"


def test_a_rate_that_is_none_points_anywhere() -> None:
    np.testing.assert_array_equal(turntable._unit(np.array([0.0, 3.0, -4.0])),
                                  [0.0, 0.6, -0.8])  # fmt: skip
    assert np.linalg.norm(turntable._unit(np.zeros(3))) == 1.0
