"""A recording without noise: whole milligravities behind a filter."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from session_folders import NINE, places, recorded, write_session

from fieldcal.cli import main
from fieldcal.core.samples import Block
from fieldcal.model.rows.vibration import quiet_window_noise
from fieldcal.physics.recording import grids_of
from fieldcal.sim_device.profile import ZERO, NoiseFigures, Profile

MG, MRAD = 9.80665e-3, 1e-3
SILENT = NoiseFigures(ZERO, ZERO, acc_instability=ZERO, gyr_instability=ZERO)
WHERE = places(NINE[:4], seconds=8.0)


def coarse(turns: bool = True) -> Block:
    """What such a device sends; `turns` says whether its gyroscopes say anything."""
    block = recorded(Profile(noise=SILENT), WHERE)
    rates = block.gyr if turns else np.full_like(block.gyr, 0.004)
    acc, gyr = np.round(block.acc / MG) * MG, np.round(rates / MRAD) * MRAD
    return replace(block, acc=acc, gyr=gyr)


@pytest.mark.parametrize(
    "turns", [pytest.param(True, marks=pytest.mark.thorough), False]
)
def test_it_is_solved_with_the_error_that_rounding_leaves(
    tmp_path: Path, turns: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = write_session(tmp_path / "s", coarse(turns), WHERE)
    assert main(["solve", str(folder)]) == 0, capsys.readouterr().err
    found: Any = json.loads((folder / "result.json").read_text())
    sigma = np.array(found["parameters"]["acc_bias"]["sigma"], float)
    assert (sigma > MG / 12 / np.sqrt(len(WHERE))).all()
    assert main(["diagnose", str(folder)]) in (0, 1), capsys.readouterr().err
    told = json.loads((folder / "diagnosis.json").read_text())
    named = [effect["id"] for effect in told["effects"]]
    assert "stuck" not in named or not turns


def test_noise_has_a_floor_of_the_grain_that_shows_on_the_way() -> None:
    block = coarse()
    windows = np.array(
        [np.searchsorted(block.t, (p["start_s"] + 1, p["end_s"] - 1)) for p in WHERE]
    )
    np.testing.assert_allclose(grids_of(block), [MG] * 3 + [MRAD] * 3, rtol=1e-6)
    noise = quiet_window_noise(block, windows, 100.0).white
    assert (noise > np.repeat([0.99 * MG, 0.99 * MRAD], 3) / np.sqrt(12)).all()
