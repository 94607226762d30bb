"""The latitude that is stated, against the Earth's rate in the gyroscopes."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from fieldcal.calibration import Calibration
from fieldcal.core.positions import Position
from fieldcal.solve import Observations, solve
from fieldcal.solve.latitude import VerticalEarthRate

EARTH = 7.292115e-5
UNSURE = 5e-5
"""Noise of a window's mean at which the latitude is hardly told, rad/s."""
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
    "latitude",
    [*(pytest.param(p, marks=pytest.mark.thorough) for p in (-70.0, 0.0)), 50.0],
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
    far = VerticalEarthRate(4e-5, 5e-4, 1e-6, 10.0)
    near = VerticalEarthRate(4e-5, EARTH * 1.001, 1e-6, 10.0)
    unlikely = VerticalEarthRate(4e-5, 0.0, 1e-6, -1.0)
    assert (
        near.latitude_wrong and not far.latitude_wrong and not unlikely.latitude_wrong
    )
    assert "latitude 90°" in near.sentence


def test_a_device_without_the_rate_of_the_earth_is_said_to_be_that() -> None:
    """As simulators are; biases are right, which they were not with it."""
    pulls = []
    for seed in range(3):
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


SOME = [Position.deg(a, b) for a, b in
        ((0, 0), (22.5, 0), (45, 5), (180, 0), (90, 0), (0, 90))]  # fmt: skip


def mixture(means: np.ndarray, noise: float, said: float) -> tuple[np.ndarray, ...]:
    """Weights of the Earth's rate as stated, another or none; mean and sigma of biases.

    Dense, of gyroscopes whose scale factor is 1: y_i = b + R_i e + noise.
    """
    phi = np.deg2rad(said)
    level = EARTH * np.cos(phi) / np.sqrt(2)
    turns = [about_x(p.beta or 0.0) @ about_z(p.alpha or 0.0) for p in SOME]
    a = np.hstack([np.tile(np.eye(3), (len(SOME), 1)), np.vstack(turns)])
    y = means[:, 3:].ravel()
    ln, value, square = [], [], []
    for vertical, sizes in (
        (-EARTH * np.sin(phi), [level, 0.0, level]),
        (-EARTH * np.sin(phi), [level, EARTH, level]),
        (0.0, [0.0, 0.0, 0.0]),
    ):
        left = y - a[:, 4] * vertical
        prior = np.diag([1e-2, 1e-2, 1e-2, *sizes]) ** 2
        cov = a @ prior @ a.T + noise**2 * np.eye(len(y))
        square_sum = left @ np.linalg.solve(cov, left)
        ln.append(-0.5 * (square_sum + np.linalg.slogdet(cov)[1]))
        gain = prior @ a.T @ np.linalg.inv(cov)
        value.append((gain @ left)[:3])
        square.append(np.diag(prior - gain @ a @ prior)[:3])
    odds = np.exp(np.array(ln) - max(ln)) * [1.0, 1e-3, 1e-3]
    weight = odds / odds.sum()
    mean = weight @ value
    spread = weight @ (np.array(square) + (np.array(value) - mean) ** 2)
    return weight, mean, np.sqrt(spread)


@pytest.mark.thorough
def test_what_cannot_be_decided_of_the_latitude_is_in_the_uncertainty() -> None:
    """As averaged densely over the three possibilities."""
    seen_open = 0
    for seed in range(12):
        means, _ = seen(SOME, 47.0, UNSURE, seed)
        weight, mean, sigma = mixture(means, UNSURE, -47.0)
        found = solved(SOME, 47.0, -47.0, noise=UNSURE, seed=seed)
        value, got = found.vector("gyr_bias")
        if not found.good or not 0.05 < weight.max() < 0.95:
            continue
        seen_open += 1
        assert (got > 0.95 * sigma).all() and (got < 2.5 * sigma).all()
        assert (np.abs(value - mean) < got).all()
    assert seen_open >= 4
