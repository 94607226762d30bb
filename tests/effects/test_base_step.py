"""A base that is knocked: what it does to rows, to a diagnosis and to a calibration."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from session_folders import CALM, FACES, WIDE, places, recorded, write_session

from fieldcal.cli import main
from fieldcal.core.frames import earth_rate_at_home
from fieldcal.core.samples import Array
from fieldcal.effects import catalogue
from fieldcal.physics.effect import Motion, Sensor
from fieldcal.physics.experience import Experience
from fieldcal.sim_device.profile import NoiseFigures
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
    """Not where nothing is felt, not on the way, not where all angles are unknown."""
    x = rows()
    assert not step(replace(x, f=0 * x.f, w=0 * x.w), -1.0).any()
    assert not step(replace(x, position=np.full(12, -1)), -1.0).any()
    unknown = replace(x, alpha=np.full(12, np.nan))
    assert not catalogue()["base_step"].applies(unknown)
    assert not catalogue()["base_step"].applies(replace(x, position=0 * x.position))


def test_a_force_of_unknown_direction_turns_and_keeps_its_length() -> None:
    """By whole rotations about the two axes, of which any turn of the force is made."""
    x = replace(rows(), alpha=np.full(12, np.nan))
    by, small = step(x, -1.0), 1e-5
    assert not step(replace(x, rate=np.ones((12, 3))), -1.0).any()  # a table turns it
    up = x.f / np.linalg.norm(x.f, axis=1, keepdims=True)
    for j in (0, 1):
        axis = np.cross(up, by[:, :3, j])
        axis /= np.linalg.norm(axis, axis=1, keepdims=True)
        turned = Rotation.from_rotvec(np.deg2rad(small) * axis).apply(x.f)
        np.testing.assert_allclose((turned - x.f) / small, by[:, :3, j], atol=1e-6)
    assert np.allclose((by[:, :3, 0] * by[:, :3, 1]).sum(axis=1), 0.0, atol=1e-9)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("conceals", "times"), [("base_step", 1.0), ("base_step", 5.0), ("bias_step", 1.0)]
)
def test_a_knock_in_a_position_of_unknown_angles_is_no_jump_of_biases(
    conceals: str, times: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Which would change the length of the force there.

    Of 1.25 degrees the square shows, and turns to and from that place meet another
    attitude.
    """
    taken = places([*WIDE[:5], (60.0, 20.0), (-50.0, -30.0)])
    at = taken[-1]["start_s"] + 5.0
    numbers = {
        "base_step": {
            "about_x_deg": 0.15 * times,
            "about_z_deg": -0.2 * times,
            "at_s": at,
        },  # fmt: skip
        "bias_step": {"ax": 0.02, "ay": 0.03, "az": -0.02, "at_s": at},
    }
    hidden = checked_effect(conceals, numbers[conceals])
    low = NoiseFigures(
        acc=(1e-3,) * 3, gyr=(1e-4,) * 3,
        acc_instability=(0.0,) * 3, gyr_instability=(0.0,) * 3,
    )  # fmt: skip
    profile = replace(CALM, effects=(*CALM.effects, hidden), noise=low)
    block = recorded(profile, taken, 5)
    for one in taken[-2:]:
        del one["alpha_deg"], one["beta_deg"]
    write_session(tmp_path / "s", block, taken)
    main(["solve", str(tmp_path / "s"), "--json", "--angles", "0.002"])
    said = json.loads(capsys.readouterr().out)
    causes = said["carried"]["causes"]
    # in the last position, a device that slips does the same
    alike = {"base_step", "mount_slip"} if conceals == "base_step" else {conceals}
    assert sum(causes.get(name, 0.0) for name in alike) > 0.9
    jumped = [numbers["bias_step"][n] for n in ("ax", "ay", "az")]
    end = np.array(jumped) if conceals == "bias_step" else np.zeros(3)
    bias = said["parameters"]["acc_bias"]
    off = np.array(bias["value"]) - profile.truth.acc_bias - end
    assert (np.abs(off) < 4 * np.array(bias["sigma"])).all()


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
    jump of a bias. A knock would hardly turn it about the axis of one angle alone.
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
        assert {"misset", "bias_step"} <= causes.keys()
