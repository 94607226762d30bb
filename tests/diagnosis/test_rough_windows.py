"""Windows that reach into the turns beside them are no other unit of the rates."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from session_folders import places, recorded, write_session

from fieldcal.cli import main
from fieldcal.core.samples import Block
from fieldcal.diagnosis.signal.chain import check_chain
from fieldcal.evaluation.prepared_session import PreparedSession
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.session.folder import Session
from fieldcal.sim_device.profile import Profile

HELD = places([(0, 0), (22.5, 0), (45, 0), (45, 5), (0, 5)], seconds=20.0, gap=3.0)
ROUGHLY = [
    p | {"start_s": max(0.0, p["start_s"] - 1), "end_s": p["end_s"] + 1.9} for p in HELD
]
DEG = float(np.deg2rad(1.0))


@pytest.fixture(scope="module")
def block() -> Block:
    return recorded(Profile(), HELD)


def read_as(
    unit: float, block: Block, folder: Path, positions: list[dict[str, Any]]
) -> Path:
    """A session whose rates were taken for rad/s, and are in another unit."""
    read = Block.of(block.t, block.acc, unit * block.gyr)
    return write_session(folder, read, positions)


@pytest.mark.parametrize(
    "unit",
    [pytest.param(1.0, marks=pytest.mark.thorough), DEG],
    ids=["rad/s", "deg/s"],
)
def test_a_turn_inside_the_windows_tells_no_unit(
    unit: float, block: Block, tmp_path: Path
) -> None:
    for positions, wrong in ((ROUGHLY, False), (HELD, unit != 1.0)):
        folder = read_as(unit, block, tmp_path / str(wrong), positions)
        session = Session.open(folder)
        assert ("mounting" in check_chain(session.block, session.about).ids) == wrong
        # solve keeps the calm part of each window, beside which the turn is whole
        calm = PreparedSession(session, usable_windows(session)).about
        assert ("mounting" in check_chain(session.block, calm).ids) == (unit != 1.0)


def test_the_unit_that_solve_finds_beside_the_calm_parts_is_said(
    block: Block, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = read_as(DEG, block, tmp_path / "s", ROUGHLY)
    assert main(["solve", str(folder), "--json"]) == 1
    warnings = "".join(json.loads(capsys.readouterr().out)["warnings"])
    assert "import it again with --gyr-unit" in warnings
