"""What is not known of gravity, against the gravity of places."""

from __future__ import annotations

import pytest

from fieldcal.core.gravity import normal_gravity
from fieldcal.session.description import Description
from fieldcal.session.description_file import parse_description
from fieldcal.session.site_gravity import gravity_sigma


def at(**site: float) -> Description:
    return parse_description({"site": site})


@pytest.mark.parametrize("latitude", [-90.0, -60.0, 0.0, 30.0, 75.0])
@pytest.mark.parametrize("site", [{}, {"gravity": normal_gravity(45.0)}])
def test_gravity_of_any_place_is_within_what_is_said(
    latitude: float, site: dict[str, float]
) -> None:
    about = at(**site)
    assert abs(normal_gravity(latitude) - about.gravity) < 2 * gravity_sigma(about)
    assert gravity_sigma(about) < 0.02


def test_a_place_says_gravity_but_for_its_anomaly() -> None:
    # the largest free-air anomalies on land are of some 400 mGal
    assert 1e-4 < gravity_sigma(at(latitude_deg=50.0, height_m=200.0)) < 1e-3


@pytest.mark.parametrize("height", [0.0, 500.0, 1600.0, 2240.0])
def test_a_height_that_is_not_said_is_within_what_is_said(height: float) -> None:
    about = at(latitude_deg=40.0)
    assert abs(normal_gravity(40.0, height) - about.gravity) < 3.5 * gravity_sigma(
        about
    )


def test_gravity_beside_its_place_is_known_to_what_the_two_differ_by() -> None:
    normal = normal_gravity(50.0, 100.0)
    for off in (0.0, 5e-4, -3e-3):
        about = at(latitude_deg=50.0, height_m=100.0, gravity=normal + off)
        assert gravity_sigma(about) == pytest.approx(abs(off), abs=1e-12)
