"""A base that moves over the Earth, against the path of a point in space."""

from __future__ import annotations

import doctest
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from session_folders import recorded, write_session

from fieldcal.core import base_motion
from fieldcal.core.base_motion import BaseMotion
from fieldcal.diagnosis import diagnose
from fieldcal.evaluation.prepared_session import PreparedSession
from fieldcal.evaluation.solution import solve_session
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.session.description_file import parse_description
from fieldcal.session.folder import Session
from fieldcal.sim_device import earth
from fieldcal.sim_device import profile as device
from fieldcal.sim_device.profile import Profile
from fieldcal.sim_device.vocabulary import parse
from fieldcal.solve import solve

SITE = {"latitude_deg": 55.0, "height_m": 20.0, "north_m_s": 60.0, "east_m_s": -90.0}
FACES = ((0, 0), (180, 0), (90, 0), (-90, 0), (0, 90), (0, -90))


def test_examples_in_the_text() -> None:
    failed, tried = doctest.testmod(base_motion, extraglobs={"np": np})
    assert tried and not failed


@given(
    st.floats(-300, 300), st.floats(-300, 300), st.floats(-1.4, 1.4), st.floats(0, 1e4)
)
def test_it_is_the_path_of_a_point_in_space(
    north: float, east: float, latitude: float, height: float
) -> None:
    """Second differences of places, and first ones of axes, in inertial space."""
    found = BaseMotion.from_velocity(north, east, latitude, height)
    rate, pull = earth.moving_base_terms(latitude, height, north, east)
    np.testing.assert_allclose(found.rate, rate[:, 0], atol=2e-10)
    np.testing.assert_allclose(found.force, pull[:, 0], atol=1e-6)


def test_a_base_that_stands_adds_nothing() -> None:
    found = BaseMotion.from_velocity(0.0, 0.0, 0.9)
    assert not found.rate.any() and not found.force.any() and found.force_tilt == 0.0
    rate, pull = earth.moving_base_terms(0.9, 0.0, 0.0, 0.0)
    assert not rate.any() and not pull.any()


def test_what_a_session_says() -> None:
    """Gravity is less by what sailing east takes; tactical grade knows no north."""
    still, moving = (
        parse_description({"format": 1, "site": {"latitude_deg": 55.0} | v})
        for v in ({}, {"east_m_s": 20.0, "north_m_s": 10.0, "level_deg": 0.01})
    )  # fmt: skip
    adds = BaseMotion.from_velocity(10.0, 20.0, np.deg2rad(55.0))
    assert moving.gravity == pytest.approx(still.gravity - adds.force[1])
    assert moving.velocity == (10.0, 20.0)
    assert moving.base_motion.force[[0, 2]].tolist() == [0.0, 0.0]
    assert moving.level_deg == pytest.approx(
        np.hypot(0.01, np.rad2deg(adds.force_tilt))
    )
    with pytest.raises(Exception, match="north_m_s"):
        parse_description({"format": 1, "site": {"north_m_s": "fast"}})


def session(folder: Path, **said: Any) -> Session:
    """A session of navigation grade in an aircraft, and what is said of it."""
    places = [
        {"alpha_deg": float(a), "beta_deg": float(b),
         "start_s": 4.0 + 38 * i, "end_s": 34.0 + 38 * i}
        for i, (a, b) in enumerate(FACES)
    ]  # fmt: skip
    profile = Profile(
        device=device.Identity(grade="navigation"),
        sampling=device.Sampling(50.0),
        site=device.Site(**SITE),
        truth=device.Truth(gyr_bias=(1e-5, -2e-5, 3e-5), acc_bias=(2e-3, 1e-3, -2e-3),
                           acc_scale=device.ONE, gyr_scale=device.ONE),
        noise=device.NoiseFigures(
            acc=(1e-3,) * 3, gyr=(2e-5,) * 3,
            acc_instability=device.ZERO, gyr_instability=device.ZERO,
        ),
        effects=(parse("earth_rate"),),
    )  # fmt: skip
    site = {k: v for k, v in SITE.items() if k not in said}
    write_session(
        folder, recorded(profile, places), places,
        device={"grade": "navigation", "name": "n"},
        site=site | {"level_deg": 1e-4, "angle_setting_deg": 1e-4},
    )  # fmt: skip
    return Session.open(folder)


@pytest.mark.parametrize(
    "explained", [False, pytest.param(True, marks=pytest.mark.thorough)]
)
def test_biases_and_scale_factors_under_way(tmp_path: Path, explained: bool) -> None:
    one = session(tmp_path)
    if explained:
        found = solve_session(one, usable_windows(one))
    else:
        laid = PreparedSession(one, usable_windows(one))
        found = solve(
            laid.observations,
            recorded=laid.recorded_rows(True),
            angle_sigma_deg=1e-4,
            level_sigma_deg=1e-4,
        )
    truth = dict.fromkeys((f"acc_scale.{x}" for x in "xyz"), 1.0)
    truth |= dict(
        zip((f"acc_bias.{x}" for x in "xyz"), (2e-3, 1e-3, -2e-3), strict=True)
    )
    truth |= dict(
        zip((f"gyr_bias.{x}" for x in "xyz"), (1e-5, -2e-5, 3e-5), strict=True)
    )
    sigma = np.sqrt(np.diag(found.covariance))
    for name, value in truth.items():
        at = found.names.index(name)
        assert abs(found.values[at] - value) < 4 * sigma[at], name
    carried = found.info.get("carried", {}).get("causes", {})
    assert "not_carried" not in found.info and all(p < 0.5 for p in carried.values())


@pytest.mark.thorough
def test_a_velocity_that_nobody_said_is_not_called_nothing(tmp_path: Path) -> None:
    """Gravity, level and the rate of the base are wrong."""
    unsaid = session(tmp_path, north_m_s=0, east_m_s=0)
    assert [e.id for e in diagnose(unsaid.block, unsaid.about).effects] != []
