"""Sessions that `solve` and `diagnose` refuse: nothing in them may count twice."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from session_folders import places, recorded, write_session

from fieldcal.cli import main
from fieldcal.core.samples import Block
from fieldcal.sim_device.profile import Profile

ANGLES = [(0.0, 0.0), (90.0, 0.0), (-90.0, 0.0), (0.0, 90.0)]
HELD = places(ANGLES, seconds=5.0, gap=3.0)


UNEXAMINED = {"model": {"effects": ["nonsense"]}}
"""Means are solved all the same, and no effect is looked for in the samples."""


@pytest.fixture(scope="module")
def block() -> Block:
    return recorded(Profile(), HELD)


@pytest.mark.parametrize("command", ["solve", "diagnose"])
@pytest.mark.parametrize(
    "listed",
    [
        [window for window in HELD for _ in range(20)],
        [*HELD[:2], {**HELD[1], "start_s": HELD[1]["start_s"] + 2.0}, *HELD[2:]],
    ],
    ids=["listed often", "overlapping"],
)
def test_no_sample_counts_twice(
    command: str,
    listed: list[dict[str, float]],
    block: Block,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    folder = write_session(tmp_path / "s", block, listed)
    assert main([command, str(folder)]) == 2
    assert "the device cannot be in both" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["solve", "diagnose"])
@pytest.mark.parametrize(
    ("triad", "sign", "says"),
    [("gyr", 1.0, "gx and gy"), ("acc", 1.0, "ax and ay"), ("gyr", -1.0, "gx and gy")],
)
def test_a_channel_that_copies_another_is_refused(
    command: str,
    triad: str,
    sign: float,
    says: str,
    block: Block,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    three = getattr(block, triad).copy()
    three[:, 1] = sign * three[:, 0]
    copied = replace(block, **{triad: three})
    folder = write_session(tmp_path / "s", copied, HELD)
    assert main([command, str(folder)]) == 2
    said = capsys.readouterr().err
    assert says in said and "the same numbers" in said


def test_a_device_without_gyroscopes_is_no_copy(
    block: Block, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    still = replace(block, gyr=np.zeros_like(block.gyr))
    folder = write_session(tmp_path / "s", still, HELD, **UNEXAMINED)
    main(["solve", str(folder)])
    assert "the same numbers" not in capsys.readouterr().err


@pytest.mark.parametrize(
    ("tables", "says"),
    [
        (UNEXAMINED, "no effect in the catalogue"),
        (
            {"range": {"acceleration": 5.0}, **UNEXAMINED},
            "beyond [range] acceleration = 5 m/s^2",
        ),
        pytest.param(
            {"range": {"angular_rate": 0.01}},
            "beyond [range] angular_rate = 0.01 rad/s",
            marks=pytest.mark.thorough,
        ),
        ({"site": {"height_m": 10.0}, **UNEXAMINED}, "the site is not stated"),
        pytest.param({"range": {"acceleration": 1e3}}, "", marks=pytest.mark.thorough),
    ],
)
def test_solve_says_which_fact_it_cannot_use(
    tables: dict[str, dict[str, object]],
    says: str,
    block: Block,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    folder = write_session(tmp_path / "s", block, HELD, **tables)
    main(["solve", str(folder), "--json"])
    said = capsys.readouterr().err
    assert says in said
    if not says:
        assert "beyond [range]" not in said and "nobody said" not in said


@pytest.mark.parametrize(
    "effects", [pytest.param([], marks=pytest.mark.thorough), ["nonsense"]]
)
def test_what_could_not_be_examined_is_no_go(
    effects: list[str],
    block: Block,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Samples and turns might contradict the means, as with outputs exchanged."""
    tables = {"run": {"procedure": "positions"}, "model": {"effects": effects}}
    folder = write_session(tmp_path / "s", block, HELD, **tables)
    main(["solve", str(folder), "--json"])
    checks = json.loads(capsys.readouterr().out)["decision"]["checks"]
    refused = {check["name"] for check in checks if check["ok"] is False}
    assert ("recording" in refused) == bool(effects)
