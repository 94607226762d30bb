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
    rows = turned(4, 50.0, hold=6.0)
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


@pytest.mark.parametrize("sides", [7, 2])
def test_what_was_not_recorded_is_not_left_out(tmp_path: Path, sides: int) -> None:
    code, found = solved(tmp_path, sides, 80.0)
    assert (code, found["verdict"]) == (0, "good")
    assert not any("left out; without" in w for w in found["warnings"])
