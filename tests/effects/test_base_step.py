"""A base that is knocked: what it does to rows, to a diagnosis and to a calibration."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from session_folders import CALM, FACES, WIDE, places, recorded, write_session

from fieldcal.cli import main
from fieldcal.core.frames import earth_rate_at_home
from fieldcal.core.samples import Array
from fieldcal.effects import catalogue
from fieldcal.physics.effect import Motion, Sensor
from fieldcal.physics.experience import Experience
from fieldcal.sim_device.vocabulary import checked_effect


def rows(**known: object) -> Experience:
    rng = np.random.default_rng(3)
    alpha, beta, gamma = rng.uniform(-1.5, 1.5, (3, 12))
    more = {"gamma": gamma, "base_rate": earth_rate_at_home(0.9), **known}
    return Experience.at_rest(alpha, beta, 9.81, **more)


def step(x: Experience, at: float) -> Array:
    one = catalogue()["base_step"]
    assert isinstance(one, Sensor)
    return one.design(x, {"at_s": at})


def test_it_is_a_small_tilt_of_the_base_from_the_instant_on() -> None:
    """By differences of what a whole tilt makes of force and rate."""
    x, tilt = rows(lasts=np.full(12, 1.0)), catalogue()["base_tilt"]
    assert isinstance(tilt, Motion)
    by = step(x, 5.2)
    assert not by[:5].any()
    part = np.r_[0.3, np.ones(6)]  # of row 5, which lasts from 4.5 to 5.5 s
    for j, one in enumerate(1e-3 * np.eye(2)):
        up, down = (tilt.change(x, sign * one) for sign in (1.0, -1.0))
        whole = np.hstack([up.f - down.f, up.w - down.w]) / 2e-3
        np.testing.assert_allclose(by[5:, :, j], part[:, None] * whole[5:], atol=1e-10)


def test_it_is_nothing_of_the_device() -> None:
    """Not where nothing is felt, not on the way, not where nobody knows the angles."""
    x = rows()
    assert not step(replace(x, f=0 * x.f, w=0 * x.w), -1.0).any()
    assert not step(replace(x, position=np.full(12, -1)), -1.0).any()
    unknown = replace(x, alpha=np.full(12, np.nan))
    assert not step(unknown, -1.0).any()
    assert not catalogue()["base_step"].applies(unknown)
    assert not catalogue()["base_step"].applies(replace(x, position=0 * x.position))


@pytest.mark.parametrize(
    ("held", "last"),
    [pytest.param(WIDE, False, marks=pytest.mark.thorough), (FACES[::-1], True)],
)
@pytest.mark.thorough
def test_a_calibration_on_a_base_that_is_knocked_is_right(
    held: list[tuple[float, float]],
    last: bool,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Where the base does stand shows in the positions after it.

    In the last position it cannot be told from an angle that was set wrongly, or from a
    jump of a bias: then the result has all of them.
    """
    taken = places(held)
    at = taken[-1 if last else 6]["start_s"] - 0.5
    tilt = {"about_x_deg": 0.0 if last else 0.12, "about_z_deg": 0.06 if last else 0.1}
    profile = replace(
        CALM, effects=(*CALM.effects, checked_effect("base_step", {**tilt, "at_s": at}))
    )
    write_session(tmp_path / "s", recorded(profile, taken, 5), taken)
    main(["solve", str(tmp_path / "s"), "--json", "--angles", "0.002"])
    said = json.loads(capsys.readouterr().out)
    causes = said["carried"]["causes"]
    assert last or causes["base_step"] > 0.9
    for name in ("acc_bias", "acc_scale", "gyr_bias"):
        found = said["parameters"][name]
        off = np.array(found["value"]) - getattr(profile.truth, name)
        assert (np.abs(off) < 4 * np.array(found["sigma"])).all(), name
    if last:
        assert {"misset", "base_step", "bias_step"} <= causes.keys()
