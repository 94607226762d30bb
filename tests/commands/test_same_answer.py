"""The same recording has the same answer, to the last digit, in every process."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from session_folders import places, recorded, write_session

from fieldcal.core.samples import Block
from fieldcal.sim_device.profile import Profile, Truth

HELD = [(0, 0), (45, 0), (45, 5), (-45, 5), (-45, 0), (0, 5)]
UNLIKE = {"taken_at", "software"}
"""What may differ."""


def restarted(block: Block, at_s: float) -> Block:
    """Samples of a device that was off for some seconds, with other biases then."""
    before = (block.t < at_s)[:, None]
    other = replace(
        block,
        acc=block.acc + before * [0.01, -0.02, 0.004],
        gyr=block.gyr + before * [3e-5, 0.0, -5e-5],
    )
    return other[np.flatnonzero((block.t < at_s) | (block.t > at_s + 4.0))]


def answers(folder: Path, seed: str) -> list[Any]:
    """Results of both commands in processes of their own."""
    out = []
    for command, name in (("solve", "result.json"), ("diagnose", "diagnosis.json")):
        subprocess.run(
            [sys.executable, "-m", "fieldcal", command, str(folder)],
            env={**os.environ, "PYTHONHASHSEED": seed}, capture_output=True,
            check=False,
        )  # fmt: skip
        told = json.loads((folder / name).read_text())
        out.append({k: v for k, v in told.items() if k not in UNLIKE})
    return out


@pytest.mark.thorough
def test_a_restart_is_the_same_one_in_every_process(tmp_path: Path) -> None:
    """Which of its sizes was taken once depended on where they were in memory."""
    held = places([(float(a), float(b)) for a, b in HELD], seconds=20.0, gap=9.0)
    truth = Truth((0.05, -0.1, 0.02), (1.002, 0.999, 1.0), (1e-3, 0.0, -1e-3))
    block = restarted(recorded(Profile(truth=truth), held), 3.0 + 5 * 29.0 - 7.0)
    folder = write_session(tmp_path / "s", block, held)
    first = answers(folder, "1")
    assert "bias_step" in first[0]["carried"]["causes"]
    for seed in ("2", "3"):
        assert answers(folder, seed) == first
