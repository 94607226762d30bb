"""Sessions whose latitude is not stated: the Earth's rate may be that of any place."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from fieldcal.calibration import Calibration
from fieldcal.core.errors import InputError
from fieldcal.evaluation.observations import build_observations
from fieldcal.session.description_file import parse_description
from fieldcal.solve import solve
from fieldcal.windows import Average

EARTH, GRAVITY, NOISE = 7.292115e-5, 9.80629, 1e-6
TWO, LEANING = (
    [(0.0, 0.0), (0.0, 50.0)],
    [*itertools.product((-50, 0, 50), (-40, 0, 40))],
)


def averages(
    positions: list[tuple[float, float]], latitude: float, bias: np.ndarray, seed: int
) -> list[Average]:
    """Means of windows at a latitude, deg; the base points anywhere."""
    rng = np.random.default_rng(seed)
    heading, phi = rng.uniform(0, 2 * np.pi), np.deg2rad(latitude)
    east, north = EARTH * np.cos(phi) * np.array([np.sin(heading), np.cos(heading)])
    sd = np.repeat([1e-4, NOISE], 3)
    means = []
    for alpha, beta in np.deg2rad(positions):
        ca, sa, cb, sb = np.cos(alpha), np.sin(alpha), np.cos(beta), np.sin(beta)
        turned = np.array([[1, 0, 0], [0, cb, sb], [0, -sb, cb]]) @ np.array(
            [[ca, sa, 0], [-sa, ca, 0], [0, 0, 1]]
        )
        rate = turned @ [east, -EARTH * np.sin(phi), north]  # y points down
        six = np.concatenate([turned @ [0, -GRAVITY, 0], rate])
        means.append(six + np.concatenate([np.zeros(3), bias]) + rng.normal(0, sd))
    return [
        Average(m, np.diag(sd**2), np.nan, 3000, 40.0 * i, 40.0 * i + 30.0)
        for i, m in enumerate(means)
    ]


def calibrated(
    positions: list[tuple[float, float]], latitude: float, bias: np.ndarray, seed: int
) -> Calibration:
    tables = [{"alpha_deg": float(a), "beta_deg": float(b)} for a, b in positions]
    about = parse_description({"site": {"gravity": GRAVITY}, "position": tables})
    seen = averages(positions, latitude, bias, seed)
    return solve(build_observations(about, seen), angle_sigma_deg=0.001)


@pytest.mark.parametrize(
    ("positions", "count"),
    [
        pytest.param(TWO, 15, id="two"),
        pytest.param(LEANING, 8, id="leaning"),
        pytest.param(TWO, 40, marks=pytest.mark.thorough, id="two, often"),
        pytest.param(LEANING, 40, marks=pytest.mark.thorough, id="leaning, often"),
    ],
)
def test_biases_are_as_uncertain_as_the_place_is(
    positions: list[tuple[float, float]], count: int
) -> None:
    """On places spread evenly over the Earth, with gyroscopes that would show it."""
    rng = np.random.default_rng(5)
    square = []
    for seed in range(count):
        latitude = float(np.rad2deg(np.arcsin(rng.uniform(-1, 1))))
        bias = rng.normal(0, 1e-3, 3)
        found = calibrated(positions, latitude, bias, seed)
        value, _ = found.vector("gyr_bias")
        names = [f"gyr_bias.{a}" for a in "xyz"]
        at = [found.names.index(n) for n in names]
        spread = found.covariance[np.ix_(at, at)]
        off = value - bias
        square.append(off @ np.linalg.solve(spread, off))
    assert 2.0 < np.mean(square) < 4.3, "chi-square of three degrees of freedom"


def test_a_place_that_is_stated_is_the_reference() -> None:
    about = parse_description(
        {
            "site": {"latitude_deg": -30.0},
            "position": [{"alpha_deg": 0.0, "beta_deg": 0.0}],
        }
    )
    stated = build_observations(about, averages([(0.0, 0.0)], 0.0, np.zeros(3), 1))
    assert stated.latitude == pytest.approx(-np.pi / 6)


def test_navigation_grade_without_a_latitude_has_no_known_rate() -> None:
    about = parse_description({"device": {"grade": "navigation"}})
    assert about.latitude_deg is None and not about.base_rate.any()
    assert about.gravity == pytest.approx(9.80620, abs=1e-4), "of 45 degrees"


def test_a_velocity_without_a_latitude_is_refused() -> None:
    with pytest.raises(InputError, match="latitude_deg"):
        parse_description({"site": {"north_m_s": 10.0}})
