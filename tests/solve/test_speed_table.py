"""Gyroscopes by the length of a rate whose axis nobody knows: the scalar method."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from session_folders import write_session

from fieldcal.calibration import Calibration
from fieldcal.cli import main
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block
from fieldcal.diagnosis import diagnose
from fieldcal.evaluation.observations import observe
from fieldcal.session.folder import Session
from fieldcal.solve import solve

Array = NDArray[np.float64]

OMEGA, G, RATE_HZ, WINDOW_S = 7.292115e-5, 9.81, 50.0, 40.0
BIAS = np.array([0.004, -0.007, 0.002])
SCALE = np.array([1.004, 0.997, 1.006])


def turned(
    folder: Path,
    seed: int,
    spins: int = 12,
    rests: int = 3,
    speed: float = 20.0,
    off: float = 0.0,
    bias: Array = BIAS,
    noise: float = 2e-3,
    **stated: Any,
) -> Session:
    """A device set on a table anyhow; its axis lies somewhere, and the Earth turns."""
    rng = np.random.default_rng(seed)
    earth, axis = Rotation.random(2, rng).apply([0.0, 0.0, 1.0])
    times, outputs, positions = [], [], []
    for i in range(spins + rests):
        start = 3.0 + i * (WINDOW_S + 10.0)
        t = start + np.arange(0.0, WINDOW_S, 1 / RATE_HZ)
        held = Rotation.random(random_state=rng)
        rate = held.apply(axis) * np.deg2rad(speed) * (1 + off) * (i < spins)
        round_ = Rotation.from_rotvec(-np.outer(t - start, rate))
        w = rate + round_.apply(held.apply(OMEGA * earth))
        lever = np.cross(rate, np.cross(rate, [0.1, 0.0, 0.2]))
        force = round_.apply(held.apply([0.0, -G, 0.0])) + lever
        times.append(t)
        outputs.append(np.hstack([force, bias + SCALE * w]))
        known = {"speed_deg_s": speed, **stated} if i < spins else {}
        positions.append({"start_s": start, "end_s": start + WINDOW_S, **known})
    six = np.vstack(outputs)
    six += rng.standard_normal(six.shape) * np.repeat([0.005, noise], 3)
    block = Block.of(np.concatenate(times), six[:, :3], six[:, 3:])
    write_session(folder, block, positions, device={"name": "on a table"})
    return Session.open(folder)


def pulls(found: Calibration, bias: Array = BIAS) -> Array:
    """Of bias and scale factor, (6,)."""
    out = []
    for group, true in (("gyr_bias", bias), ("gyr_scale", SCALE)):
        values, sigmas = found.vector(group)
        out.append((values - true) / sigmas)
    return np.concatenate(out)


def solved(session: Session) -> Calibration:
    seen, said = observe(session)
    assert not said
    return solve(seen)


@pytest.mark.parametrize(
    ("rests", "seeds"),
    [
        pytest.param(0, 3, marks=pytest.mark.thorough),
        (3, 1),
        pytest.param(3, 3, marks=pytest.mark.thorough),
    ],
)
def test_the_length_of_a_rate_gives_bias_and_scale_factor(
    tmp_path: Path, rests: int, seeds: int
) -> None:
    every = []
    for seed in range(seeds):
        found = solved(turned(tmp_path / str(seed), seed, rests=rests))
        assert found.vector("gyr_scale")[1].max() < 2e-3
        every.append(pulls(found))
        gyr = found.info["gyroscopes"]
        # one mean along the rate of each window is left of three
        assert gyr["dof"] == 12 + 3 * rests - 6
        assert gyr["rms"] < 4e-4
    assert 0.5 < np.sqrt(np.mean(np.square(every))) < 1.2
    assert np.abs(every).max() < 4


@pytest.mark.parametrize("count", [1, pytest.param(4, marks=pytest.mark.thorough)])
def test_a_bias_as_large_as_the_rate_bends_nothing(tmp_path: Path, count: int) -> None:
    """What is read points far from the axis at first."""
    bias = np.array([0.05, -0.08, 0.03])
    every = [
        pulls(solved(turned(tmp_path / str(s), s, speed=5.0, bias=bias)), bias)
        for s in range(count)
    ]
    assert np.abs(every).max() < 4


@pytest.mark.thorough
def test_what_the_speed_is_off_by_is_in_every_scale_factor(tmp_path: Path) -> None:
    sigma, rng, every = 0.05, np.random.default_rng(5), []
    for seed in range(8):
        off = float(rng.normal(0, sigma / 20.0))
        made = turned(tmp_path / str(seed), seed, off=off, speed_sd_deg_s=sigma)
        found = solved(made)
        at = [found.names.index(f"gyr_scale.{axis}") for axis in "xyz"]
        block = found.covariance[np.ix_(at, at)]
        size = np.sqrt(np.diag(block))
        assert (block / np.outer(size, size)).min() > 0.9
        every.append(pulls(found)[3:])
    assert 0.6 < np.sqrt(np.mean(np.square(every))) < 1.5


def test_too_few_axes_leave_scale_factors_open(tmp_path: Path) -> None:
    found = solved(turned(tmp_path, 1, spins=2))
    assert len(found.components("gyr_scale")) < 3
    assert any("gyr_scale" in w for w in found.warnings)
    assert np.abs(pulls(found)[:3]).max() < 4


@pytest.mark.thorough
def test_a_table_with_nothing_wrong_is_diagnosed_as_that(
    tmp_path: Path,
) -> None:
    session = turned(tmp_path, 2)
    said = diagnose(session.block, session.about)
    assert not [effect.id for effect in said.effects]


def test_the_command_and_the_report(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    turned(tmp_path, 3, spins=7, rests=2)
    assert main(["solve", str(tmp_path)]) in (0, 1)
    assert "gyro scale factor x" in capsys.readouterr().out
    assert main(["report", str(tmp_path)]) == 0


def test_the_printed_formulas_have_no_place_for_it(tmp_path: Path) -> None:
    seen, _ = observe(turned(tmp_path, 4, spins=3))
    with pytest.raises(InputError, match="about an axis that nobody knows"):
        solve(seen, as_printed=True)
