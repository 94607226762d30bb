"""Gravity that nobody said, and rounding that nobody knows, against what they do."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.calibration import Calibration
from fieldcal.core.gravity import gravity
from fieldcal.evaluation.unsaid import gravity_sigma, with_unsaid
from fieldcal.session.description import Description, parse

NAMES = tuple(f"{g}.{a}" for g in ("acc_bias", "acc_scale") for a in "xyz")
SMALL = 1e-6
EXACTLY = np.zeros(3)


def calibration() -> Calibration:
    return Calibration(
        "joint", NAMES, np.repeat([0.1, 1.01], 3), SMALL**2 * np.eye(6),
        ("m/s^2",) * 3 + ("1",) * 3, 7.0, 7, 1e-3,
    )  # fmt: skip


def at(**site: float) -> Description:
    return parse({"site": site})


def test_a_place_says_gravity_but_for_its_anomaly() -> None:
    found = with_unsaid(calibration(), at(latitude_deg=50.0, height_m=200.0), EXACTLY)
    assert found.uncertainty("acc_bias.x") == SMALL
    assert 1e-5 < found.uncertainty("acc_scale.x") < 5e-5


@pytest.mark.parametrize("latitude", [-90.0, -60.0, 0.0, 30.0, 75.0])
@pytest.mark.parametrize("site", [{}, {"gravity": gravity(45.0)}])
def test_the_scale_of_any_place_is_within_what_is_said(
    latitude: float, site: dict[str, float]
) -> None:
    found = with_unsaid(calibration(), at(**site), EXACTLY)
    # of gravity taken as that of 45 degrees
    off = found.value("acc_scale.x") * (gravity(latitude) / gravity(45.0) - 1)
    sigma = found.uncertainty("acc_scale.x")
    assert abs(off) < 2 * sigma and sigma < 2e-3
    rows = [NAMES.index(f"acc_scale.{a}") for a in "xy"]
    both = found.covariance[np.ix_(rows, rows)]
    assert both[0, 1] / both[0, 0] == pytest.approx(1.0, abs=1e-3)
    assert found.uncertainty("acc_bias.x") == SMALL


@pytest.mark.parametrize("height", [0.0, 500.0, 1600.0, 2240.0])
def test_a_height_that_is_not_said_is_within_what_is_said(height: float) -> None:
    about = at(latitude_deg=40.0)
    assert abs(gravity(40.0, height) - about.gravity) < 3.5 * gravity_sigma(about)


def test_gravity_beside_its_place_is_known_to_what_the_two_differ_by() -> None:
    normal = gravity(50.0, 100.0)
    for off in (0.0, 5e-4, -3e-3):
        about = at(latitude_deg=50.0, height_m=100.0, gravity=normal + off)
        assert gravity_sigma(about) == pytest.approx(abs(off), abs=1e-12)


def test_values_rounded_down_are_in_the_bias() -> None:
    found = with_unsaid(
        calibration(), at(latitude_deg=50.0, height_m=0.0), np.array([0.0, 0.01, 0.0])
    )
    assert found.uncertainty("acc_bias.y") == pytest.approx(0.01, rel=1e-6)
    assert found.uncertainty("acc_bias.x") == SMALL
