"""Positions that had to be left out, and what is not determined without them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from laid_about import turned
from session_folders import write_session

from fieldcal.cli import main
from fieldcal.core.samples import Block


def solved(tmp_path: Path, sides: int, full_scale: float) -> tuple[int, Any]:
    """Exit code and result of a device laid on some sides, az having a full scale."""
    rows = turned(4, 50.0, hold=6.0, sides=7)
    rows[:, 3] = np.clip(rows[:, 3], -full_scale, full_scale)
    held = [{"start_s": 7.5 * i + 0.5, "end_s": 7.5 * i + 5.5} for i in range(sides)]
    block = Block.of(rows[:, 0], rows[:, 1:4], rows[:, 4:])
    folder = write_session(tmp_path / "s", block, held)
    code = main(["solve", str(folder)])
    return code, json.loads((folder / "result.json").read_text())


def test_a_full_scale_below_gravity_is_bad(tmp_path: Path) -> None:
    code, found = solved(tmp_path, 7, 8.0)
    assert (code, found["verdict"]) == (1, "bad")
    (says,) = [w for w in found["warnings"] if "were left out; without" in w]
    assert "acc_scale.z" in says and says.endswith("record them again")


def test_what_is_known_no_better_than_of_any_unit_is_not_determined(
    tmp_path: Path,
) -> None:
    """Tilted positions in which az is within its full scale leave a number for z."""
    device = Block.of(*leaning(full_scale=9.6))
    held = [{"start_s": 10.0 * i, "end_s": 10.0 * i + 9.9} for i in range(12)]
    folder = write_session(tmp_path / "s", device, held)
    assert main(["solve", str(folder)]) == 1
    found = json.loads((folder / "result.json").read_text())
    sigma = found["parameters"]["acc_scale"]["sigma"]
    assert all(s is not None for s in sigma) and max(sigma) > 0.01
    (says,) = [w for w in found["warnings"] if "were left out; without" in w]
    assert "acc_scale.z" in says


def leaning(full_scale: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, forces and rates of a device on its six faces and leaning in six more."""
    faces = np.vstack([np.eye(3), -np.eye(3)])
    lean = [[7, -5, 4.8], [-5, -7, 4.7], [7, 7, 0.3], [-7, 7, -0.2],
            [5, -6.9, -5], [-6.9, 5, -5.1]]  # fmt: skip
    axes = np.vstack([faces, lean])
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    rng = np.random.default_rng(5)
    acc = np.repeat(9.80665 * axes, 500, axis=0) + [0.05, -0.04, 0.02]
    acc += rng.normal(0, 5e-3, acc.shape)
    gyr = rng.normal(0, 1e-3, acc.shape)
    return np.arange(len(acc)) / 50, np.clip(acc, -full_scale, full_scale), gyr


@pytest.mark.thorough
@pytest.mark.parametrize("sides", [7, 2])
def test_what_was_not_recorded_is_not_left_out(tmp_path: Path, sides: int) -> None:
    code, found = solved(tmp_path, sides, 80.0)
    assert (code, found["verdict"]) == (0, "good")
    assert not any("left out; without" in w for w in found["warnings"])
