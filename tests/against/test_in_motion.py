"""Recordings in motion, held against what follows the motion."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from driven_like import DRIVE, written
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from benchmarks.in_motion.driven import Drive, coloured, recorded
from benchmarks.in_motion.pairs import (
    ABOUT,
    CALIBRATION,
    KINDS,
    WHITE,
    block_of,
    compared,
    pulls,
)
from fieldcal.against import Match
from fieldcal.against.motion import compare_in_motion
from fieldcal.against.motion.held import what_is_held
from fieldcal.cli import main
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block
from fieldcal.effects import catalogue as known
from fieldcal.session.description_file import parse_description
from fieldcal.sim_device.effects import catalogue, kind
from fieldcal.sim_device.profile_file import profile_from_tables
from fieldcal.sim_device.replay import HeldWindow, simulate
from fieldcal.sim_device.vocabulary import checked_effect

TESTS = Path(__file__).parent.parent
NAMES = ("recording", "simulator")
NOISE = {"noise": {"white": WHITE, "markov": WHITE / 2, "tau": 2.0}}
IN_MOTION = [name for name in catalogue() if kind(name).EXAMPLE.in_motion]
"""Effects that only a reference shows which follows the motion."""


@pytest.fixture(scope="module")
def true() -> Block:
    return block_of(recorded(DRIVE, {}, 80.0, 25.0))


def held(device: Mapping[str, Any], true: Block, seconds: float = 60.0) -> Match:
    real = block_of(recorded(DRIVE, {"start": 5.0, **device}, seconds, 25.0))
    return compare_in_motion((real, ABOUT), true, NAMES)


def number(found: Match, name: str, parameter: str) -> tuple[float, float]:
    (one,) = (d for d in found.differences if d.id == name)
    off = one.parameters[parameter].difference
    return float(off.value), float(off.sigma or np.nan)


@pytest.mark.statistical
@pytest.mark.parametrize(
    "kind",
    [
        KINDS.index("cubic"),
        pytest.param(KINDS.index("increments"), marks=pytest.mark.thorough),
        pytest.param(KINDS.index("stamp_error"), marks=pytest.mark.thorough),
        pytest.param(KINDS.index("flexible_mount"), marks=pytest.mark.thorough),
    ],
)
def test_what_was_drawn_comes_back_within_its_uncertainty(kind: int) -> None:
    one, found, _ = compared(kind, 7_100)
    effects = {d.id for d in found.differences} - CALIBRATION
    assert effects == ({one.kind} if one.kind else set())
    off = np.array(pulls(one, found))
    assert len(off) >= 6 and np.abs(off).max() < 4.5
    assert np.sqrt(np.mean(off**2)) < 1.8
    assert 0.85 < found.after.chi2_per_dof < 1.15 < found.before.chi2_per_dof


def test_clock_and_axes_are_told_with_their_uncertainty(true: Block) -> None:
    turn = Rotation.from_rotvec([0.3, -0.2, 1.4])
    device = {"clock": (2.5, 8e-5), "turn": turn.as_matrix(), **NOISE}
    where = held(device, true).aligned
    assert where is not None
    # start + (t - delay) (1 + rate) by the simulator's clock
    at = where.at_s
    expected = {
        "delay": (where.delay, at - (5.0 + (at - 2.5) * (1 + 8e-5))),
        "drift": (where.drift, 80.0),
    }
    for axis, angle in zip("xyz", np.rad2deg(turn.as_rotvec()), strict=True):
        expected[axis] = (where.turn[axis], float(angle))
    for name, (told, wanted) in expected.items():
        assert abs(float(told.value) - wanted) < 4 * (told.sigma or 0), name
    assert (where.delay.sigma or 1) < 1e-4 and (where.drift.sigma or 9) < 2.0
    assert where.compared_s > 50


@pytest.mark.thorough
def test_several_at_once_with_late_gyroscopes_off_the_centre(true: Block) -> None:
    device = {"arm": (0.2, -0.15, 0.1), "late": 0.02, "g": 2e-4 * np.eye(3), **NOISE}
    found = held(device, true)
    assert {d.id for d in found.differences} - CALIBRATION == {
        "lever_arm", "time_delay", "g_sensitivity",
    }  # fmt: skip
    for name, parameter, wanted in (
        ("lever_arm", "x", 0.2),
        ("lever_arm", "y", -0.15),
        ("time_delay", "seconds", 0.02),
        ("g_sensitivity", "g22", 2e-4),
    ):
        value, sigma = number(found, name, parameter)
        assert abs(value - wanted) < 4.5 * sigma < 0.2 * abs(wanted), parameter
    assert found.verdict == "left_out"
    (arm,) = (d for d in found.differences if d.id == "lever_arm")
    assert {"ax", "ay", "az"} <= {m.channel for m in arm.where}


@pytest.mark.thorough
@pytest.mark.statistical
def test_time_constants_come_back_within_their_uncertainty() -> None:
    which, off = KINDS.index("bandwidth"), []
    for one, found, _ in (compared(which, 7_300 + 50 * k) for k in range(4)):
        told = {d.id for d in found.differences} - CALIBRATION
        assert told == {"bandwidth"}
        off += [
            (float(pair.difference.value) - one.truth[d.id, name])
            / (pair.difference.sigma or np.nan)
            for d in found.differences
            for name, pair in d.parameters.items()
            if d.id == "bandwidth"
        ]
    assert len(off) >= 5 and np.abs(off).max() < 4


@pytest.mark.thorough
def test_a_time_constant_is_told_beside_a_delay_and_a_delay_is_none(
    true: Block,
) -> None:
    both = held({"late": 0.02, "lag": (0.0, 0.015), **NOISE}, true)
    assert {d.id for d in both.differences} - CALIBRATION == {
        "time_delay", "bandwidth",
    }  # fmt: skip
    late, late_sigma = number(both, "time_delay", "seconds")
    tau, tau_sigma = number(both, "bandwidth", "gyr")
    assert abs(late - 0.02) < 4 * late_sigma and abs(tau - 0.015) < 4 * tau_sigma
    (one,) = (d for d in both.differences if d.id == "bandwidth")
    acc = one.parameters.get("acc")
    shared = float(acc.difference.value) if acc else 0.0
    assert abs(late + tau - shared - 0.035) < 5e-5, "low frequencies show the sum"
    alone = held({"late": 0.02, **NOISE}, true)
    assert {d.id for d in alone.differences} - CALIBRATION == {"time_delay"}
    assert number(alone, "time_delay", "seconds")[1] < 1e-4


@pytest.mark.thorough
def test_one_filter_of_both_triads_is_a_time_constant_of_both(true: Block) -> None:
    found = held({"lag": (0.004, 0.004), **NOISE}, true, seconds=40.0)
    assert {d.id for d in found.differences} - CALIBRATION == {"bandwidth"}
    for name in ("acc", "gyr"):
        tau, sigma = number(found, "bandwidth", name)
        assert abs(tau - 0.004) < 4 * sigma < 0.003


@pytest.mark.thorough
def test_the_low_pass_of_a_simulator_is_a_time_constant_below_nothing() -> None:
    slow = block_of(recorded(DRIVE, {"lag": (0.02, 0.02)}, 80.0, 25.0))
    found = held(NOISE, slow, seconds=30.0)
    assert {d.id for d in found.differences} - CALIBRATION == {"bandwidth"}
    for name in ("acc", "gyr"):
        tau, sigma = number(found, "bandwidth", name)
        assert abs(tau + 0.02) < 4 * sigma < 0.008


@pytest.mark.thorough
def test_a_butterworth_filter_is_no_delay_and_no_time_constant(true: Block) -> None:
    found = held({"second": (0.0, 0.03), **NOISE}, true)
    assert {d.id for d in found.differences} - CALIBRATION == {"second_order"}
    tau, sigma = number(found, "second_order", "gyr")
    assert abs(tau - 0.03) < 4 * sigma < 1e-3
    assert 0.85 < found.after.chi2_per_dof < 1.15 < found.before.chi2_per_dof


@pytest.mark.thorough
def test_the_butterworth_filter_of_a_simulator_is_one_below_nothing() -> None:
    slow = block_of(recorded(DRIVE, {"second": (0.03, 0.03)}, 80.0, 25.0))
    found = held(NOISE, slow, seconds=30.0)
    assert {d.id for d in found.differences} - CALIBRATION == {"second_order"}
    for name in ("acc", "gyr"):
        tau, sigma = number(found, "second_order", name)
        assert abs(tau + 0.03) < 4 * sigma < 0.006


def test_a_long_delay_is_no_filter_of_either_triad() -> None:
    """About no filter the one is as linear as the other; fits of their own tell."""
    one, found, _ = compared(43, 34_400)
    assert one.kind == "time_delay"
    assert {d.id for d in found.differences} - CALIBRATION == {"time_delay"}
    assert np.abs(pulls(one, found)).max() < 4.5


@pytest.mark.thorough
def test_a_filter_that_is_nothing_beside_a_delay_is_tried_all_the_same() -> None:
    """Linearised about no filter it explains less than a delay leaves."""
    one, found, _ = compared(26, 34_800)
    assert one.kind == "second_order"
    assert {d.id for d in found.differences} - CALIBRATION == {"second_order"}
    assert np.abs(pulls(one, found)).max() < 4.5


@pytest.mark.thorough
def test_a_mount_as_soft_along_every_axis_is_nearly_a_filter() -> None:
    """To second order it is the inverse of a low-pass, and a delay."""
    one, found, _ = compared(19, 34_100)
    softest, stiffest = (
        np.max(one.device["compliance"]),
        np.min(one.device["compliance"]),
    )
    assert softest < 1.06 * stiffest
    effects = [d for d in found.differences if d.id not in CALIBRATION]
    told = {name for d in effects for name in (d.id, *d.aliases)}
    assert told == {"flexible_mount", "bandwidth", "time_delay"}
    assert found.verdict == "ambiguous"


@pytest.mark.thorough
def test_stamps_of_a_coarse_clock_are_told_from_samples_that_are_uneven(
    true: Block,
) -> None:
    table = recorded(DRIVE, {"start": 5.0, **NOISE}, 50.0, 25.0)
    coarse = table.copy()
    coarse[:, 0] = np.floor(table[:, 0] / 0.015) * 0.015
    found = compare_in_motion((block_of(coarse), ABOUT), true, NAMES)
    assert {d.id for d in found.differences} - CALIBRATION == {"stamp_error"}
    share, sigma = number(found, "stamp_error", "share")
    assert abs(share - 1) < 4 * sigma < 0.2
    # the same stamps of samples that were taken at them
    even = recorded(DRIVE, {"start": 5.0}, 50.0, 25.0)
    spline = CubicSpline(even[:, 0], even[:, 1:])
    rng = np.random.default_rng(2)
    coarse[:, 1:] = spline(coarse[:, 0]) + rng.normal(0, WHITE, (len(coarse), 6))
    kept = compare_in_motion((block_of(coarse[5:-5]), ABOUT), true, NAMES)
    assert not {d.id for d in kept.differences} - CALIBRATION


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[] if name == "stamp_error" else pytest.mark.thorough)
        for name in IN_MOTION
    ],
)
def test_what_only_motion_shows_is_named_of_the_virtual_device(name: str) -> None:
    angles = ((0, 0), (90, 40), (-60, 0), (30, -70), (0, 80), (-90, -30)) * 2
    windows = [
        HeldWindow(np.deg2rad(a), np.deg2rad(b), 2.0 + 3 * i, 3.0 + 3 * i)
        for i, (a, b) in enumerate(angles)
    ]
    plain = profile_from_tables(
        {"sampling": {"rate_hz": 50.0}, "motion": {"turn_s": 1.0}}
    )
    given = kind(name).EXAMPLE.given
    real = simulate(plain.having(checked_effect(name, given)), windows, seed=3)
    sim = simulate(plain, windows, seed=4, noise=False)
    found = compare_in_motion((real, ABOUT), sim, NAMES)
    assert {d.id for d in found.differences} - CALIBRATION == {name}
    for part in set(given) & set(known()[name].names):
        value = given[part]
        told, sigma = number(found, name, part)
        assert abs(told - value) < 4 * sigma < 0.5 * value


def test_nothing_is_said_of_what_is_alike() -> None:
    table = recorded(DRIVE, {}, 40.0, 25.0)
    for seed in range(1):
        rng = np.random.default_rng(seed)
        real, sim = table.copy(), table.copy()
        real[:, 1:] += coloured(rng, len(table), 0.04, NOISE["noise"])
        sim[:, 1:] += coloured(rng, len(table), 0.04, NOISE["noise"])
        found = compare_in_motion((block_of(real), ABOUT), block_of(sim), NAMES)
        assert found.verdict == "consistent" and not found.differences
        assert found.before.chi2_per_dof == pytest.approx(1.0, abs=0.1)


def test_motions_with_nothing_in_common_are_refused(true: Block) -> None:
    other = block_of(recorded(Drive(11), {}, 60.0, 25.0))
    with pytest.raises(InputError, match="recording and simulator show no common"):
        compare_in_motion((other, ABOUT), true, NAMES)


def test_a_motion_that_repeats_itself_is_refused() -> None:
    once = recorded(DRIVE, {}, 40.0, 25.0)
    twice = np.vstack([once, once + [40.0, *[0.0] * 6]])
    real = once.copy()
    real[:, 1:] += coloured(np.random.default_rng(1), len(real), 0.04, {"white": 0.1})
    with pytest.raises(InputError, match="repeats itself: shifted by"):
        compare_in_motion((block_of(real), ABOUT), block_of(twice), NAMES)


@pytest.mark.thorough
def test_a_recording_beside_itself_is_alike(true: Block) -> None:
    assert compare_in_motion((true, ABOUT), true, NAMES).verdict == "consistent"


def test_too_little_in_common_is_refused(true: Block) -> None:
    with pytest.raises(InputError, match="at least 20 s in one piece are needed"):
        held(NOISE, true, seconds=15.0)


@pytest.mark.parametrize(
    ("real", "sim", "says"),
    [
        pytest.param(slice(3, 6), slice(0, 0), [], marks=pytest.mark.thorough),
        (slice(0, 0), slice(0, 3), ["simulator: has no accelerometers"]),
    ],
)
def test_one_triad_is_compared_where_the_other_is_not_there(
    real: slice, sim: slice, says: list[str], true: Block
) -> None:
    device = {"start": 5.0, "matrix_gyr": 1.01 * np.eye(3), **NOISE}
    one, two = (
        without(block, some)
        for block, some in (
            (block_of(recorded(DRIVE, device, 60.0, 25.0)), real),
            (true, sim),
        )
    )
    found = compare_in_motion((one, ABOUT), two, NAMES)
    scaled = set() if real.stop else {"gyr_scale"}
    assert {d.id for d in found.differences} == scaled
    assert all(any(w.startswith(s) for w in found.warnings) for s in says)
    assert 0.9 < found.after.chi2_per_dof < 1.1


@pytest.mark.parametrize("count", [1, 2, 7])
def test_few_samples_of_either_side_are_refused(true: Block, count: int) -> None:
    short = true[:count]
    with pytest.raises(InputError, match=f"^recording: its channels have {count} sam"):
        compare_in_motion((short, ABOUT), true, NAMES)
    with pytest.raises(InputError, match=f"^simulator: its channels have {count} sam"):
        compare_in_motion((true, ABOUT), short, NAMES)


def test_a_window_without_samples_hides_no_position() -> None:
    """The first of the windows lies before the recording."""
    forces = np.repeat(9.8 * np.vstack([np.eye(3), -np.eye(3)]), 100, axis=0)
    t = np.arange(len(forces)) / 50
    windows = [(2.0 * i, 2.0 * i + 1.9) for i in range(6)]
    about = parse_description(
        {
            "format": 1,
            "position": [
                {"start_s": a, "end_s": b} for a, b in [(-9.0, -1.0), *windows]
            ],
        }
    )
    assert what_is_held(Block.of(t, forces), about) == "positions"


def test_different_triads_are_refused(true: Block) -> None:
    acc, gyr = without(true, slice(3, 6)), without(true, slice(0, 3))
    with pytest.raises(InputError, match="no moving triad in common"):
        compare_in_motion((acc, ABOUT), gyr, NAMES)


def test_a_recording_of_a_moment_is_refused(true: Block) -> None:
    with pytest.raises(InputError, match="no common motion|at least 20 s"):
        compare_in_motion((true[:10], ABOUT), true, NAMES)


def without(block: Block, channels: slice) -> Block:
    """Samples that lack some channels."""
    six = block.six
    six[:, channels] = np.nan
    return Block.of(block.t, six[:, :3], six[:, 3:])


@pytest.mark.thorough
def test_files_are_compared_by_their_motion(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    device: dict[str, Any] = {"start": 5.0, "bias": np.repeat([0.05, 0.0], 3)}
    device["arm"] = (0.2, 0.0, 0.0)
    device["turn"] = Rotation.from_rotvec([0.0, 0.0, 0.02]).as_matrix()
    real = written(tmp_path / "real.csv", recorded(DRIVE, device | NOISE, 40.0, 25.0))
    sim = written(tmp_path / "sim.csv", recorded(DRIVE, {}, 50.0, 25.0))
    folder = tmp_path / "session"
    assert main(["import", real, "--acc-unit", "m/s^2", "-o", str(folder)]) == 0
    call = ["diagnose", str(folder), "--against", sim, "--patch", "json"]
    assert main(call) == 1
    told = capsys.readouterr()
    assert "lever arm" in told.out and "of common motion" in told.out
    assert "json has nothing for misalignment" in told.err
    assert "does not show the simulator's own biases and scale factors" in told.err
    content = json.loads((folder / "against.json").read_text())
    assert content["alignment"]["delay"]["value"] == pytest.approx(-5.0, abs=1e-3)
    patch = json.loads((folder / "patch.json").read_text())
    assert patch["effects"]["lever_arm"]["x"] == pytest.approx(0.2, abs=0.002)


@pytest.mark.thorough
def test_a_command_is_patched_until_it_moves_as_the_recording(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("PYTHONPATH", f"{TESTS}:{TESTS.parent}")
    given = {"start": 5.0, "bias": np.repeat([0.05, 0.0], 3), "arm": (0.2, 0.0, 0.0)}
    device = {**given, "lag": (0.0, 0.02), **NOISE}
    real = written(tmp_path / "real.csv", recorded(DRIVE, device, 40.0, 25.0))
    folder = tmp_path / "session"
    assert main(["import", real, "--acc-unit", "m/s^2", "-o", str(folder)]) == 0
    command = f"{sys.executable} {TESTS / 'driven_like.py'} {{patch}} {{out}}"
    assert main(["diagnose", str(folder), "--against", command, "--rounds", "2"]) == 0
    said = capsys.readouterr()
    assert "lever arm" in said.err and "bandwidth" in said.err
    assert "patched: nothing" in said.err
    content = json.loads((folder / "against.json").read_text())
    assert content["prediction"]["before"]["chi2_per_dof"] < 1.1
    patch = json.loads((folder / "patch.json").read_text())
    assert patch["effects"]["bandwidth"]["gyr"] == pytest.approx(0.02, abs=1e-3)
    assert patch["effects"]["lever_arm"]["x"] == pytest.approx(0.2, abs=2e-3)


@pytest.mark.thorough
def test_noise_of_the_reference_is_no_filter_of_the_device() -> None:
    """Quick motion below that noise looks as if it had gone through a low-pass."""
    one, found, _ = compared(0, 5000, seconds=60.0, hz=50.0, noise=8.0)
    assert not one.kind
    assert {d.id for d in found.differences} <= CALIBRATION
    (said,) = (w for w in found.warnings if "accelerometers have noise" in w)
    density, sigma = re.findall(r"([\d.]+) ± ([\d.]+) m/s\^2/sqrt\(Hz\)", said)[0]
    off = float(density) - 8 * WHITE[0] / 50**0.5
    assert abs(off) < 4 * float(sigma)
    assert float(sigma) < 0.1 * float(density)
