"""A device that slips in its mount: what it does to rows and to a calibration."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from session_folders import CALM, WIDE, places, recorded, write_session

from fieldcal.cli import main
from fieldcal.core.frames import earth_rate_at_home
from fieldcal.core.samples import Array
from fieldcal.effects import catalogue
from fieldcal.physics.attitude_step import AttitudeStep
from fieldcal.physics.effect import Sensor
from fieldcal.physics.experience import Experience
from fieldcal.sim_device.vocabulary import checked_effect


def test_it_turns_what_is_felt_in_every_row_from_the_instant_on() -> None:
    """On the way between positions too; by rotations of the axes of the device."""
    rng, slip = np.random.default_rng(3), catalogue()["mount_slip"]
    alpha, beta = rng.uniform(-1.5, 1.5, (2, 12))
    x = Experience.at_rest(
        alpha, beta, 9.81, base_rate=earth_rate_at_home(0.9), lasts=np.ones(12)
    )
    x = replace(x, w=x.w + rng.normal(size=(12, 3)), position=np.arange(12) - 4)
    assert isinstance(slip, Sensor)
    by = slip.design(x, {"at_s": 5.2})
    assert not by[:5].any()
    part = np.r_[0.3, np.ones(6)]  # of row 5, which lasts from 4.5 to 5.5 s
    for j, axis in enumerate(np.eye(3)):
        up, down = (Rotation.from_rotvec(s * 1e-4 * axis).inv() for s in (1.0, -1.0))
        turned = [(up.apply(v) - down.apply(v)) / 2e-4 for v in (x.f, x.w)]
        whole = np.deg2rad(np.hstack(turned))
        np.testing.assert_allclose(by[5:, :, j], part[:, None] * whole[5:], atol=1e-8)


@pytest.mark.thorough
def test_a_calibration_of_a_device_that_slips_is_right(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """No step of the base, and none of the biases, is the same about all of them."""
    taken = places(WIDE)
    slip = {"about_x_deg": 0.2, "about_y_deg": -0.15, "about_z_deg": 0.25}
    hidden = checked_effect("mount_slip", {**slip, "at_s": taken[6]["start_s"] + 7.0})
    profile = replace(CALM, effects=(*CALM.effects, hidden))
    write_session(tmp_path / "s", recorded(profile, taken, 5), taken)
    main(["solve", str(tmp_path / "s"), "--json", "--angles", "0.002"])
    said = json.loads(capsys.readouterr().out)
    assert said["carried"]["causes"]["mount_slip"] > 0.9
    for name in ("acc_bias", "acc_scale", "gyr_bias"):
        found = said["parameters"][name]
        off = np.array(found["value"]) - getattr(profile.truth, name)
        assert (np.abs(off) < 4 * np.array(found["sigma"])).all(), name


@pytest.mark.thorough
def test_a_slip_in_a_position_is_known_to_positions_of_unknown_angles(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """By the length of the force alone, with turns that begin after the slip.

    The accelerometers do not see it about the vertical, which is no reason for it to
    be none: it would be a cross-coupling in the position after.
    """
    faces = [(85.0, 8.0), (-95.0, -6.0), (175.0, 10.0), (5.0, 80.0), (-8.0, -83.0)]
    taken = places([(0.0, 0.0), (45.0, 5.0), *faces])
    slip = {"about_x_deg": -0.1, "about_y_deg": 0.2, "about_z_deg": -0.4}
    hidden = checked_effect("mount_slip", {**slip, "at_s": taken[0]["start_s"] + 9.0})
    profile = replace(CALM, effects=(*CALM.effects, hidden))
    block = recorded(profile, taken, 5)
    for one in taken[2:]:
        del one["alpha_deg"], one["beta_deg"]
    write_session(tmp_path / "s", block, taken)
    main(["solve", str(tmp_path / "s"), "--json", "--angles", "0.002"])
    said = json.loads(capsys.readouterr().out)
    assert said["method"] == "scalar"
    assert said["carried"]["causes"]["mount_slip"] > 0.9
    found = said["parameters"]["acc_bias"]
    off = np.array(found["value"]) - profile.truth.acc_bias
    assert (np.abs(off) < 4 * np.array(found["sigma"])).all()


@pytest.mark.parametrize("name", ["mount_slip", "base_step"])
def test_a_large_turn_is_a_whole_rotation(name: str) -> None:
    """To the square of the angle, which the design leaves out."""
    rng, effect = np.random.default_rng(5), catalogue()[name]
    assert isinstance(effect, AttitudeStep)
    alpha, beta = rng.uniform(-1.5, 1.5, (2, 6))
    x = Experience.at_rest(alpha, beta, 9.81, lasts=np.ones(6))
    values = np.array([3.0, -2.0, 4.0])[: len(effect.params)]
    turned = effect.change_of_outputs(x, values, {"at_s": -9.0})
    based = name == "base_step"
    axes: Array = x.to_device[:, :, [0, 2]] if based else np.tile(np.eye(3), (6, 1, 1))
    slip = Rotation.from_rotvec(np.deg2rad(axes @ values))
    np.testing.assert_allclose(turned[:, :3], slip.inv().apply(x.f) - x.f, atol=1e-9)
    linear = effect.design(x, {"at_s": -9.0}) @ values
    square = 9.81 * slip.magnitude() ** 2
    missing = np.linalg.norm((turned - linear)[:, :3], axis=1)
    assert (missing < 0.51 * square).all() and (missing > 0.05 * square).any()
