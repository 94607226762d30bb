"""Turns that are over in a few samples, behind a low-pass: the scale stays honest."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, lfilter
from session_folders import write_session

from fieldcal.calibration import Calibration
from fieldcal.cli import main
from fieldcal.core.frames import direction_cosines
from fieldcal.core.samples import Block
from fieldcal.evaluation.prepared_session import PreparedSession
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.session.folder import Session
from fieldcal.solve import solve

ANGLES = [(0.0, 0.0), (22.5, 0.0), (22.5, 2.5), (45.0, 2.5), (45.0, 5.0)]
EACH, HOLD, FINE = 14.0, 10.0, 20
NOISE = 2e-5


def quick(
    folder: Path, rng: np.random.Generator, rate: float, seconds: float, cutoff: float
) -> Path:
    """A session at the equator's latitude, turned in `seconds` each time."""
    at = rate * FINE
    t = np.arange(int(len(ANGLES) * EACH * at)) / at
    alpha, beta, where = np.zeros(len(t)), np.zeros(len(t)), []
    for i, (a, b) in enumerate(ANGLES):
        begin = i * EACH + rng.uniform(0, 1 / rate)
        u = np.clip((t - begin) / seconds, 0, 1)
        part = u - np.sin(2 * np.pi * u) / (2 * np.pi)
        before = ANGLES[i - 1] if i else ANGLES[0]
        alpha += part * np.deg2rad(a - before[0])
        beta += part * np.deg2rad(b - before[1])
        held = {"start_s": i * EACH + 3, "end_s": i * EACH + 3 + HOLD}
        where.append({"alpha_deg": a, "beta_deg": b, **held})
    attitude = direction_cosines(alpha, beta)
    step = attitude[1:] @ np.swapaxes(attitude[:-1], 1, 2)  # exp(-[w dt]x)
    pairs = [(1, 2), (2, 0), (0, 1)]
    w = np.stack([(step[:, i, j] - step[:, j, i]) / 2 * at for i, j in pairs], axis=1)
    f = attitude @ np.array([0.0, -9.81, 0.0])
    low = butter(2, cutoff / (at / 2))
    gyr = lfilter(*low, np.vstack([np.zeros(3), w]), axis=0)[::FINE]
    acc = lfilter(*low, f - f[0], axis=0)[::FINE] + f[0]
    t = t[::FINE]
    block = Block.of(
        t,
        acc + rng.normal(0, 10 * NOISE, acc.shape),
        gyr + rng.normal(0, NOISE, gyr.shape),
        np.full(len(t), 20.0),
        np.arange(len(t), dtype=float),
        t,
    )
    site = {"latitude_deg": 0.0, "gravity": 9.81, "angle_setting_deg": 0.001}
    return write_session(folder, block, where, site=site)


@pytest.mark.parametrize(
    ("rate", "seconds", "cutoff", "explained"),
    [
        (100.0, 0.05, 20.0, False),
        pytest.param(100.0, 0.05, 20.0, True, marks=pytest.mark.thorough),
        pytest.param(50.0, 0.08, 20.0, True, marks=pytest.mark.thorough),
    ],
)
def test_a_scale_by_turns_of_a_few_samples_is_within_its_uncertainty(
    tmp_path: Path, rate: float, seconds: float, cutoff: float, explained: bool
) -> None:
    rng = np.random.default_rng(1)
    folder = quick(tmp_path / "s", rng, rate, seconds, cutoff)
    if explained:
        assert main(["solve", str(folder)]) in (0, 1)
        result = json.loads((folder / "result.json").read_text())
        found = Calibration.from_json(result)
    else:
        session = Session.open(folder)
        laid = PreparedSession(session, usable_windows(session))
        recorded = laid.recorded_rows(True)
        found = solve(laid.observations, recorded=recorded, angle_sigma_deg=0.001)
    names = [f"gyr_scale.{axis}" for axis in found.components("gyr_scale")]
    pulls = [abs(found.value(name) - 1) / found.uncertainty(name) for name in names]
    assert pulls and max(pulls) < 4.5
