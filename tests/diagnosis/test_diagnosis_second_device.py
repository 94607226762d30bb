"""Concealed by a second program: named, with the right numbers, and nothing besides."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from ladder import (
    NAVIGATION,
    TACTICAL,
    Array,
    Device,
    Fault,
    Ride,
)
from ladder_sessions import agrees, diagnosed, hold_first, named


def walk(ridden: Ride, out: Array) -> None:
    steps = 0.002 * np.sqrt(np.diff(ridden.t, prepend=0.0))
    out[:, :3] += np.cumsum(
        steps[:, None] * ridden.rng.standard_normal((len(out), 3)), 0
    )


def vibration(ridden: Ride, out: Array) -> None:
    """An engine runs in three of the windows, 2 m/s^2 rms."""
    on = np.isin(ridden.held, (1, 2, 4))[:, None]
    wave = np.sqrt(8.0) * np.sin(2 * np.pi * 17.3 * ridden.t)[:, None]
    out[:, :3] += on * (wave + 4.0 * np.array([5e-3, -4e-3, 3e-3]))


def play(ridden: Ride, out: Array) -> None:
    """Where a joint with play stands depends on where it came from."""
    out[:, :3] += ridden.turned[:, None] * [0.02, -0.015, 0.01]


def course(ridden: Ride, out: Array) -> None:
    """All axes follow one smooth course that no effect has."""
    part = ridden.t / ridden.t[-1]
    out[:, :3] += (part**3 - part)[:, None] * [0.06, -0.05, 0.04]


def coupling(ridden: Ride, out: Array) -> None:
    matrix = [[0, 0.006, 0.004], [-0.005, 0, 0.012], [0.009, 0.005, 0]]
    out[:, 3:] += ridden.w @ np.array(matrix).T


def drift(ridden: Ride, out: Array) -> None:
    out[:, :3] += ridden.t[:, None] * [1e-4, -8e-5, 0.0]


def asymmetry(ridden: Ride, out: Array) -> None:
    out[:, :3] += np.abs(ridden.f) * [4e-3, 0.0, 0.0]


def heating(ridden: Ride, out: Array) -> None:
    rate = np.gradient(ridden.warming, ridden.t)
    out[:, :3] += rate[:, None] * [0.5, -0.4, 0.3]


def flicker(ridden: Ride, out: Array) -> None:
    """Allan deviations that stay at 0.2 mg and 15 deg/h.

    A power of h / f, whose level is sqrt(2 ln 2 h), by waves k of variance h / k.
    """
    n = 4 * len(out)  # so much longer, that it does not come round
    level, k = np.repeat([2e-3, 7e-5], 3), np.arange(1, n // 2 + 1)
    size = n / 2 * level / np.sqrt(2 * np.log(2) * k[:, None])
    cosine, sine = ridden.rng.standard_normal((2, len(k), 6)) * size
    waves = np.vstack([np.zeros((1, 6)), cosine - 1j * sine])
    out += np.fft.irfft(waves, n, axis=0)[: len(out)]


@pytest.mark.parametrize(
    "device",
    [pytest.param(TACTICAL, marks=pytest.mark.thorough), NAVIGATION],
    ids=["tactical", "navigation"],
)
def test_nothing_left_out(
    device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if device is NAVIGATION:
        hold_first(6, monkeypatch)
    assert diagnosed(tmp_path / "s", device).verdict == "consistent"


@pytest.mark.thorough
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_flicker_that_every_device_has_is_nothing_left_out(
    tmp_path: Path, seed: int
) -> None:
    """No walk, no step, and no function of the time on any axis."""
    said = diagnosed(tmp_path / "s", TACTICAL, flicker, seed=seed)
    assert (named(said), said.mismatch) == ([], ())
    assert said.verdict == "consistent" and said.probability > 0.5


@pytest.mark.thorough
def test_what_is_left_out_is_found_beside_flicker(tmp_path: Path) -> None:
    said = diagnosed(tmp_path / "s", TACTICAL, flicker, asymmetry)
    assert named(said) == ["scale_asymmetry"]
    agrees(said, "scale_asymmetry", {"x": 4e-3})


@pytest.mark.thorough
def test_angles_set_by_hand_say_nothing_of_the_gyroscopes(tmp_path: Path) -> None:
    """Beta is corrected by a fraction of a degree after alpha's large turn."""
    said = diagnosed(tmp_path / "s", TACTICAL, seed=12, setting=0.2)
    assert named(said) == ["angle_setting"]
    agrees(said, "angle_setting", {"sigma_deg": 0.2})


@pytest.mark.thorough
def test_a_walk_beyond_the_noise_of_a_second(tmp_path: Path) -> None:
    said = diagnosed(tmp_path / "s", TACTICAL, walk)
    assert named(said) == ["random_walk"]
    agrees(said, "random_walk", dict.fromkeys(("ax", "ay", "az"), 0.002))


@pytest.mark.thorough
def test_a_line_that_shakes_three_windows(tmp_path: Path) -> None:
    said = diagnosed(tmp_path / "s", TACTICAL, vibration)
    assert named(said) == ["vibration_rectification"]
    # the wave was added to the outputs: what is felt is less by the scale factor
    felt = np.array([5e-3, -4e-3, 3e-3]) * np.square(TACTICAL.acc_scale)
    true = dict(zip("xyz", felt.tolist(), strict=True))
    agrees(said, "vibration_rectification", true)


@pytest.mark.parametrize(
    "fault", [play, pytest.param(course, marks=pytest.mark.thorough)]
)
@pytest.mark.thorough
def test_axes_that_go_together_do_not_wander(tmp_path: Path, fault: Fault) -> None:
    said = diagnosed(tmp_path / "s", TACTICAL, fault)
    assert said.verdict == "unexplained" and "random_walk" not in named(said)
    assert {m.channel for m in said.mismatch} >= {"ax", "ay"}


@pytest.mark.thorough
def test_rates_that_the_turns_show_are_known_to_the_windows(tmp_path: Path) -> None:
    """Gyroscopes that see the Earth see it through their cross-coupling."""
    said = diagnosed(tmp_path / "s", NAVIGATION, coupling)
    assert named(said) == ["gyro_cross_coupling"]
    agrees(said, "gyro_cross_coupling", {"s12": 0.006, "s23": 0.012, "s31": 0.009})
    (found,) = said.effects
    assert found.evidence["delta_chi2"] > 100
    assert found.evidence["held_out_gain"] > 0.5


@pytest.mark.thorough
def test_a_drift_is_no_noise(tmp_path: Path) -> None:
    said = diagnosed(tmp_path / "s", NAVIGATION, drift)
    assert named(said) == ["bias_drift"]
    agrees(said, "bias_drift", {"ax": 1e-4, "ay": -8e-5})


@pytest.mark.thorough
def test_a_temperature_that_rises_once_leaves_it_open(tmp_path: Path) -> None:
    """Towards an end at an even pace: its rate is as good as itself, or as time."""
    said = diagnosed(tmp_path / "s", TACTICAL, heating)
    (found,) = said.effects
    heard = {found.id, *found.aliases}
    assert heard >= {"temperature_bias", "thermal_hysteresis", "warm_up"}
