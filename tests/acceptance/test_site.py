"""Gravity that is stated beside the place where it is to be."""

from __future__ import annotations

from typing import Any

import pytest

from fieldcal.acceptance.site import gravity_contradiction
from fieldcal.session.description import Description
from fieldcal.session.description_file import parse_description


def at(**site: Any) -> Description:
    return parse_description({"site": site})


@pytest.mark.parametrize(
    "site",
    [
        {"gravity": 9.81058, "latitude_deg": 50.45, "height_m": 170.0},
        {"gravity": 9.8095, "latitude_deg": 50.45, "height_m": 170.0},  # an anomaly
        {"gravity": 9.7720, "latitude_deg": 19.4},  # Mexico City, its height not said
        {"gravity": 9.80665},
        {"latitude_deg": 50.45},
        {},
    ],
)
def test_what_may_be_is_not_contradicted(site: dict[str, float]) -> None:
    assert gravity_contradiction(at(**site)) == ""


def test_another_place_is_named_with_its_gravity() -> None:
    said = gravity_contradiction(at(gravity=9.80, latitude_deg=50.45, height_m=170.0))
    assert "9.8 m/s² is impossible: at 50.45° latitude and 170 m it is 9.8106" in said
    assert "anywhere on Earth" in gravity_contradiction(at(gravity=9.9))
