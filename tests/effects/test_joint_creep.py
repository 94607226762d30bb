"""Joints that creep: what it does to rows, to a diagnosis and to a calibration."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from session_folders import CALM, WIDE, places, recorded, write_session

from fieldcal.cli import main
from fieldcal.core.frames import direction_cosines, earth_rate_at_home
from fieldcal.core.rotation import rotation_vectors
from fieldcal.core.samples import Array
from fieldcal.diagnosis import diagnose
from fieldcal.effects import catalogue
from fieldcal.physics.effect import Sensor
from fieldcal.physics.experience import Experience
from fieldcal.physics.joint_turns import JointTurns
from fieldcal.session.folder import Session
from fieldcal.sim_device.vocabulary import checked_effect

P = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
ANGLES = np.array([[0, 0, 0], [0.8, 0, 0.3], [0.8, -0.5, 0.3], [-0.2, 0.4, 0.3]])
AT = np.array([0.0, 10.0, 20.0, 30.0])
TAU, SIZE = 4.0, np.array([0.1, -0.05])
"""s, and degrees of alpha and beta."""


def off(t: Array) -> Array:
    """What alpha and beta are off by after all turns, rad, (n, 2)."""
    sides = np.array([[1, 0], [0, -1], [-1, 1]])
    out = np.zeros((len(t), 2))
    for at, side in zip(AT[1:], sides, strict=True):
        left = np.where(t >= at, np.exp(-np.maximum(t - at, 0) / TAU), 0.0)
        out += np.deg2rad(SIZE) * side * left[:, None]
    return out


def rows(t: Array, crept: Array | float = 0.0, **more: object) -> Experience:
    """Rows at rest, each in the position that was turned to last."""
    p = np.searchsorted(AT, t, side="right") - 1
    alpha, beta = (ANGLES[p, :2] + crept).T
    known = {"base_rate": earth_rate_at_home(0.9), "mounting": P, **more}
    turned = JointTurns.of(AT, ANGLES)
    return Experience.at_rest(
        alpha,
        beta,
        9.81,
        gamma=ANGLES[p, 2],
        t=t,
        position=p,
        joint_turns=turned,
        **known,
    )


def outputs(x: Experience) -> Array:
    one = catalogue()["joint_creep"]
    assert isinstance(one, Sensor)
    out: Array = one.design(x, {"tau_s": TAU}) @ SIZE
    return out


def test_it_turns_the_device_about_its_joints() -> None:
    """By force and rate of a device that is held where the joints are."""
    t = np.array([3.0, 12.0, 18.0, 21.0, 27.5, 30.5, 39.0])
    by, crept = outputs(rows(t)), rows(t, off(t))
    np.testing.assert_allclose(by[:, :3], crept.f - rows(t).f, atol=3e-5)
    d = 1e-3
    for k, one in enumerate(t[1:], 1):
        p = int(np.searchsorted(AT, one, side="right") - 1)
        before, after = (
            P.T @ direction_cosines(*(ANGLES[p] + np.append(off(np.array([s]))[0], 0)))
            for s in (one - d, one + d)
        )
        # of a vector that stays in space the device sees the opposite turn
        rate = rotation_vectors(before @ after.T) / (2 * d)
        seen = rate + crept.w[k] - rows(t).w[k]
        np.testing.assert_allclose(by[k, 3:], seen, atol=5e-7)


def test_gyroscopes_follow_it_on_the_way() -> None:
    """The sum of what they see is the angle at the end, wherever that is."""
    step = 1e-3
    t = np.arange(5.0, 37.0, step)
    by = outputs(replace(rows(t), w=np.zeros((len(t), 3))))
    for end in (9.6, 10.5, 12.0, 18.5, 24.0, 35.0):
        sum_ = step * by[t < end, 3:].sum(axis=0)
        about = JointTurns.of(AT, ANGLES).axes(t, 1.0, P)
        course = np.diff(off(t), axis=0)[t[1:] < end]
        if end >= 10.0:  # before it, it goes smoothly
            want = np.einsum("nij,nj->i", about[1:][t[1:] < end], course)
            np.testing.assert_allclose(sum_, want, atol=2e-6)
        else:
            assert 0.3 < np.linalg.norm(sum_) / np.deg2rad(0.1) < 0.95


def test_a_turn_is_about_the_axes_as_they_have_crept() -> None:
    """What alpha turns is seen past beta; what beta turns, past neither."""
    t = np.array([22.0, 25.0])  # of the third position, on the way on from it
    beta, size = ANGLES[2, 1], off(t)
    way = replace(rows(t), position=np.full(2, -1))
    course = outputs(replace(way, w=np.zeros((2, 3))))[:, 3:]
    about = np.array([0.0, 0.0, 0.7])
    a, g = np.full(2, ANGLES[2, 0]), np.full(2, ANGLES[2, 2])
    plain, crept = (
        np.array(
            [
                direction_cosines(*one) @ about
                for one in zip(a, beta + more, g, strict=True)
            ]
        )
        @ P
        for more in (np.zeros(2), size[:, 1])
    )
    seen = outputs(replace(way, w=plain))[:, 3:] - course
    assert np.abs(crept - plain).max() > 3e-4
    np.testing.assert_allclose(seen, crept - plain, atol=1e-6)
    inner = JointTurns.of(AT, ANGLES).axes(t, 1.0, P)[:, :, 1]
    np.testing.assert_allclose(
        outputs(replace(way, w=0.7 * inner))[:, 3:], course, atol=1e-12
    )


def test_a_row_has_the_mean_of_its_samples() -> None:
    t = np.array([11.5, 14.0, 33.0])
    long = outputs(rows(t, lasts=np.full(3, 3.0)))
    fine = [outputs(rows(one + np.linspace(-1.5, 1.5, 2001))).mean(axis=0) for one in t]
    np.testing.assert_allclose(long, fine, rtol=2e-3, atol=1e-9)


def test_it_is_nothing_where_nobody_knows_the_joints() -> None:
    one, x = catalogue()["joint_creep"], rows(np.array([12.0, 22.0]))
    assert one.applies(x)
    for other in (
        replace(x, joint_turns=JointTurns.none()),
        replace(x, joint_turns=JointTurns.of(AT, ANGLES * 0.0)),
        replace(x, rate=np.ones((2, 3))),
    ):
        assert not one.applies(other)
    assert not outputs(replace(x, joint_turns=JointTurns.none())).any()
    assert not outputs(replace(x, joint_turns=JointTurns.of(AT, ANGLES * 0.0))).any()


def session(folder: Path, seed: int, **sizes: float) -> Path:
    """A session of a calm device whose joints creep."""
    crept = checked_effect("joint_creep", sizes)
    profile = replace(CALM, effects=(*CALM.effects, crept))
    taken = places(WIDE)
    return write_session(folder, recorded(profile, taken, seed), taken)


@pytest.mark.thorough
@pytest.mark.parametrize("tau", [20.0, pytest.param(6.0, marks=pytest.mark.thorough)])
def test_a_calibration_with_joints_that_creep_is_right(
    tau: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Also where they creep still when the recording ends: that is no bias."""
    folder = session(tmp_path / "s", 5, alpha_deg=0.6, beta_deg=0.5, tau_s=tau)
    main(["solve", str(folder), "--json", "--angles", "0.002"])
    said = json.loads(capsys.readouterr().out)
    assert said["carried"]["causes"]["joint_creep"] > 0.9
    for name in ("acc_bias", "acc_scale", "gyr_bias", "gyr_scale"):
        found = said["parameters"][name]
        error = np.array(found["value"]) - getattr(CALM.truth, name)
        assert (np.abs(error) < 4 * np.array(found["sigma"])).all(), name


@pytest.mark.parametrize("count", [1, pytest.param(30, marks=pytest.mark.thorough)])
@pytest.mark.thorough
def test_its_numbers_are_as_uncertain_as_is_said(tmp_path: Path, count: int) -> None:
    pulls = []
    for seed in range(count):
        rng = np.random.default_rng(seed)
        alpha, beta = rng.uniform(0.05, 0.3, 2) * rng.choice([-1, 1], 2)
        truth = {"alpha_deg": alpha, "beta_deg": beta, "tau_s": rng.uniform(2, 20)}
        one = Session.open(session(tmp_path / str(seed), seed, **truth))
        (found,) = diagnose(one.block, one.about).effects
        assert found.id == "joint_creep" and not found.aliases
        values = [(found.parameters[n], v) for n, v in truth.items()]
        pulls += [(p.value - v) / p.sigma for p, v in values]
    assert np.abs(pulls).max() < 4
    assert np.sqrt(np.mean(np.square(pulls))) < 1.0 + 2.0 / np.sqrt(2 * len(pulls))
