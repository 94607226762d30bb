"""Windows that reach into the turns beside them are no other unit of the rates."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from session_folders import places, recorded, write_session

from fieldcal.cli import main
from fieldcal.core.samples import Block
from fieldcal.sim_device.profile import Profile

HELD = places([(0, 0), (22.5, 0), (45, 0), (45, 5), (0, 5)], seconds=20.0, gap=3.0)
ROUGHLY = [
    p | {"start_s": max(0.0, p["start_s"] - 1), "end_s": p["end_s"] + 1.9} for p in HELD
]


@pytest.mark.parametrize("unit", [1.0, np.deg2rad(1.0)], ids=["rad/s", "deg/s"])
def test_a_turn_inside_the_windows_tells_no_unit(
    unit: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    block = recorded(Profile(), HELD)
    read = Block.of(block.t, block.acc, unit * block.gyr)
    for positions, wrong in ((ROUGHLY, False), (HELD, unit != 1.0)):
        folder = write_session(tmp_path / str(wrong), read, positions)
        main(["diagnose", str(folder), "--json"])
        said = json.loads(capsys.readouterr().out)
        named = [e["id"] for e in said["effects"]]
        assert ("mounting" in named) == wrong
        main(["solve", str(folder), "--json"])
        warnings = "".join(json.loads(capsys.readouterr().out)["warnings"])
        # solve keeps the calm part of each window, beside which the turn is whole
        assert ("import it again with --gyr-unit" in warnings) == (unit != 1.0)
