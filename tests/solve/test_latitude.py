"""The latitude that is stated, against the Earth's rate in the gyroscopes."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from fieldcal.calibration import Calibration
from fieldcal.core.positions import Position
from fieldcal.solve import Observations, solve
from fieldcal.solve.latitude import EarthVertical

EARTH = 7.292115e-5
LEANING = [Position.deg(a, b) for a, b in product((-50, 0, 50), (-40, 0, 40))]
UPRIGHT = [Position.deg(a, b) for a, b in product((-4, 0, 4), (-5, 0, 5))]


def about_x(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0], [0, c, s], [0, -s, c]])


def about_z(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])


def bias_of(seed: int) -> np.ndarray:
    rng = np.random.default_rng([seed, 1])
    return np.concatenate([rng.normal(0, 0.02, 3), rng.normal(0, 1e-3, 3)])


def seen(
    positions: list[Position],
    latitude: float,
    noise: float,
    seed: int,
    rate: float = EARTH,
) -> tuple[np.ndarray, np.ndarray]:
    """Means (n, 6) of a device at some latitude, deg, that points anywhere."""
    rng = np.random.default_rng(seed)
    heading, phi = rng.uniform(0, 2 * np.pi), np.deg2rad(latitude)
    level = rate * np.cos(phi) * np.array([np.sin(heading), 0, np.cos(heading)])
    base = level - [0, rate * np.sin(phi), 0]  # y points down
    sd = np.repeat([1e-4, noise], 3)
    bias = bias_of(seed)
    means = []
    for p in positions:
        turned = about_x(p.beta or 0.0) @ about_z(p.alpha or 0.0)
        six = np.concatenate([turned @ [0, -9.80629, 0], turned @ base])
        means.append(six + bias + rng.normal(0, sd))
    return np.array(means), np.diag(sd**2)


def solved(
    positions: list[Position],
    there: float,
    said: float,
    noise: float = 1e-6,
    seed: int = 1,
    **asked: float,
) -> Calibration:
    means, covariance = seen(positions, there, noise, seed)
    several = np.tile(covariance, (len(positions), 1, 1))
    phi = float(np.deg2rad(said))
    observations = Observations(tuple(positions), means, several, 9.80629, latitude=phi)
    return solve(observations, angle_sigma_deg=0.001, **asked)  # type: ignore[arg-type]


def contradicted(found: Calibration) -> list[str]:
    return [w for w in found.warnings if "Earth's rate of latitude" in w]


@pytest.mark.parametrize(("there", "said"), [(-35.0, 35.0), (50.0, -50.0), (8.0, 55.0)])
def test_another_latitude_is_told_and_named(there: float, said: float) -> None:
    found = solved(LEANING, there, said)
    (sentence,) = contradicted(found)
    shown = float(sentence.split("latitude ")[1].split("°")[0])
    assert abs(shown - there) < 3 and "south is negative" in sentence
    assert f"not of {said:g}°" in sentence
    assert not found.good


@pytest.mark.parametrize(
    "latitude", [-70.0, pytest.param(0.0, marks=pytest.mark.thorough), 50.0]
)
def test_the_right_one_is_never_doubted(latitude: float) -> None:
    for seed in range(8):
        found = solved(LEANING, latitude, latitude, seed=seed)
        assert found.good and not contradicted(found)


def test_positions_that_hardly_lean_show_nothing_of_it() -> None:
    """The vertical is in the biases there, and noise tells nothing."""
    found = solved(UPRIGHT, -40.0, 40.0, noise=2e-5)
    assert not contradicted(found)
    assert found.good


def test_what_no_latitude_has_is_no_latitude() -> None:
    far = EarthVertical(4e-5, 5e-4, 1e-6, 10.0)
    near = EarthVertical(4e-5, EARTH * 1.001, 1e-6, 10.0)
    unlikely = EarthVertical(4e-5, 0.0, 1e-6, -1.0)
    assert near.wrong and not far.wrong and not unlikely.wrong
    assert "latitude 90°" in near.sentence


def test_a_device_without_the_rate_of_the_earth_is_said_to_be_that() -> None:
    """As simulators are; biases are right, which they were not with it."""
    pulls = []
    for seed in range(6):
        means, covariance = seen(LEANING, 40.0, 1e-6, seed, rate=0.0)
        several = np.tile(covariance, (len(LEANING), 1, 1))
        phi = float(np.deg2rad(40.0))
        told = Observations(tuple(LEANING), means, several, 9.80629, latitude=phi)
        found = solve(told, angle_sigma_deg=0.001)
        assert found.good and not contradicted(found)
        assert any("do not show the Earth's rate" in w for w in found.warnings)
        value, sigma = found.vector("gyr_bias")
        pulls += ((value - bias_of(seed)[3:]) / sigma).tolist()
    assert 0.6 < np.sqrt(np.mean(np.square(pulls))) < 1.4
