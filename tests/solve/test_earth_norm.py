"""Gyroscopes of navigation grade at rest anyhow: |ω| is the Earth's rate."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from session_folders import write_session

from fieldcal.core.factory import FACTORY_KEYS
from fieldcal.core.samples import Block
from fieldcal.diagnosis import diagnose
from fieldcal.evaluation.observations import observe
from fieldcal.evaluation.solution import solve_session
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.session.folder import Session
from fieldcal.solve import solve

Array = NDArray[np.float64]

OMEGA, G, RATE_HZ, WINDOW_S = 7.292115e-5, 9.81, 20.0, 60.0
BIAS = np.array([2e-5, -5e-5, 4e-5])
ACC_BIAS, ACC_SCALE = np.array([0.02, -0.01, 0.03]), np.array([1.001, 0.999, 1.002])


def held(
    folder: Path, seed: int, count: int = 14, grade: str = "navigation"
) -> Session:
    """A device laid about anyhow, as by hand."""
    rng = np.random.default_rng(seed)
    latitude = np.deg2rad(50.45)
    earth = OMEGA * np.array([0.0, -np.sin(latitude), np.cos(latitude)])
    times, outputs, positions = [], [], []
    for i in range(count):
        start = 3.0 + i * (WINDOW_S + 10.0)
        t = start + np.arange(0.0, WINDOW_S, 1 / RATE_HZ)
        turned = Rotation.random(random_state=rng)
        force = ACC_BIAS + ACC_SCALE * turned.apply([0.0, -G, 0.0])
        outputs.append(np.tile([*force, *(BIAS + turned.apply(earth))], (len(t), 1)))
        times.append(t)
        positions.append({"start_s": start, "end_s": start + WINDOW_S})
    six = np.vstack(outputs)
    six += rng.standard_normal(six.shape) * np.repeat([0.002, 1e-5], 3)
    block = Block.of(np.concatenate(times), six[:, :3], six[:, 3:])
    device = {"name": "laid about", "grade": grade}
    site = {"latitude_deg": 50.45, "gravity": G}
    write_session(folder, block, positions, device=device, site=site)
    return Session.open(folder)


@pytest.mark.parametrize(
    ("recorded", "seeds"),
    [
        (False, 2),
        pytest.param(False, 6, marks=pytest.mark.thorough),
        pytest.param(True, 3, marks=pytest.mark.thorough),
    ],
)
def test_the_length_of_the_earths_rate_gives_the_bias(
    tmp_path: Path, recorded: bool, seeds: int
) -> None:
    every = []
    for seed in range(seeds):
        session = held(tmp_path / str(seed), seed)
        if recorded:
            found = solve_session(
                session, usable_windows(session), "no", dict.fromkeys(FACTORY_KEYS, 0.0)
            )
        else:
            found = solve(observe(session)[0])
        assert found.method == "scalar"
        values, sigmas = found.vector("gyr_bias")
        assert sigmas.max() < 1e-6  # 4e-5 where the Earth's rate points anywhere
        every.append((values - BIAS) / sigmas)
        force, wide = found.vector("acc_scale")
        assert np.abs((force - ACC_SCALE) / wide).max() < 4.5
    assert 0.6 < np.sqrt(np.mean(np.square(every))) < 1.4
    assert np.abs(every).max() < 4


def test_tactical_grade_has_it_pointing_anywhere(tmp_path: Path) -> None:
    found = solve(observe(held(tmp_path, 1, grade="tactical"))[0])
    assert found.vector("gyr_bias")[1].min() > 1e-5


def test_few_orientations_leave_it_pointing_anywhere(tmp_path: Path) -> None:
    found = solve(observe(held(tmp_path, 1, count=4))[0])
    values, sigmas = found.vector("gyr_bias")
    assert sigmas.min() > 1e-5 and np.abs((values - BIAS) / sigmas).max() < 4


@pytest.mark.thorough
def test_nothing_else_is_found_in_it(tmp_path: Path) -> None:
    session = held(tmp_path, 3)
    said = diagnose(session.block, session.about)
    assert not [effect.id for effect in said.effects]
