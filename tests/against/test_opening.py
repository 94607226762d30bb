"""Files of a simulator: where the device was held is worked out, or asked for."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import strapdown
from session_folders import write_session

from fieldcal.against.opening import open_simulator_output
from fieldcal.cli import main
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block
from fieldcal.session.folder import Session

HEAD = "t (s),ax (m/s^2),ay (m/s^2),az (m/s^2),gx (rad/s),gy (rad/s),gz (rad/s)"
NOISE = {"noise": {"acc": [0.02] * 3, "gyr": [1e-3] * 3}}


def write_csv(path: Path, table: Array) -> Path:
    np.savetxt(path, table, fmt="%.9g", delimiter=",", header=HEAD, comments="")
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    table = strapdown.outputs(NOISE)
    unknown = np.full(len(table), np.nan)
    block = Block.of(
        table[:, 0], table[:, 1:4], table[:, 4:7], unknown, unknown, unknown
    )
    site = {"gravity": strapdown.GRAVITY}
    there = tmp_path_factory.mktemp("real") / "real"
    return write_session(there, block, strapdown.schedule(), site=site)


def test_the_same_schedule_on_another_clock(tmp_path: Path, folder: Path) -> None:
    session = Session.open(folder)
    ours = np.array([w for w in session.windows if w])
    real = (
        replace(session.block, t=session.block.t + 700.0),
        replace(session.about, windows=tuple(map(tuple, ours + 700.0))),
    )
    path = write_csv(tmp_path / "simulated.csv", strapdown.outputs(NOISE))
    block, about, _ = open_simulator_output(path, real)
    assert block.t[0] == session.block.t[0] and len(ours) == len(strapdown.ANGLES)
    theirs = [w for w in about.windows if w]
    # a rest is found a little shorter than it is, and never longer
    np.testing.assert_allclose(np.array(theirs), ours, atol=0.15)
    assert (np.array(theirs) - ours >= -1e-9)[:, 0].all()
    assert (np.array(theirs) - ours <= 1e-9)[:, 1].all()


def test_a_simulator_that_writes_a_second_later_is_at_rest_in_its_windows(
    tmp_path: Path, folder: Path
) -> None:
    """The last second of a window by the recording's schedule is in its turns."""
    session = Session.open(folder)
    late, block_start = int(strapdown.RATE_HZ), 1.0
    path = write_csv(tmp_path / "late.csv", strapdown.outputs(NOISE)[late:])
    real = (session.block, session.about)
    _, about, _ = open_simulator_output(path, real)
    held = [w for w in about.windows if w]
    assert len(held) == len(strapdown.ANGLES)
    # it turns from half a second after each window on, but for the last
    places = strapdown.schedule()
    places[-1]["end_s"] += 3.0
    for (start, end), place in zip(held, places, strict=True):
        assert place["start_s"] - 0.5 <= block_start + start
        assert block_start + end <= place["end_s"] + 0.5
        assert end - start > 0.9 * strapdown.HELD_S


def test_other_times_of_the_same_positions_in_their_order(
    tmp_path: Path, folder: Path
) -> None:
    session = Session.open(folder)
    table = strapdown.outputs(NOISE)
    table[:, 0] *= 0.5  # held for half as long
    table[:, 4:] *= 2.0
    path = write_csv(tmp_path / "quick.csv", table)
    _, about, _ = open_simulator_output(path, (session.block, session.about))
    windows = [w for w in about.windows if w]
    assert len(windows) == len(strapdown.ANGLES)
    assert all(5.0 < end - start < 9.0 for start, end in windows)
    assert [p.degrees for p in about.positions] == [
        p.degrees for p in session.positions
    ]


def test_other_positions_are_refused(tmp_path: Path, folder: Path) -> None:
    session = Session.open(folder)
    table = strapdown.outputs(NOISE)
    path = write_csv(tmp_path / "short.csv", table[: len(table) // 3])
    with pytest.raises(InputError, match="rests 3 times .* 9 positions"):
        open_simulator_output(path, (session.block, session.about))


def rest_in(folder: Path, rate: float, seed: int) -> Path:
    """A session of a device that rests in the first position; `rate` biases gy."""
    table = strapdown.outputs({**NOISE, "seed": seed})
    place = strapdown.schedule()[0]
    kept = (table[:, 0] > place["start_s"]) & (table[:, 0] < place["end_s"])
    held = table[kept]
    held[:, 5] += rate
    unknown = np.full(len(held), np.nan)
    block = Block.of(held[:, 0], held[:, 1:4], held[:, 4:7], unknown, unknown, unknown)
    whole = {"start_s": float(held[0, 0]), "end_s": float(held[-1, 0])}
    site = {"gravity": strapdown.GRAVITY}
    return write_session(folder, block, [whole], site=site)


def test_a_session_of_fewer_positions_is_refused(tmp_path: Path, folder: Path) -> None:
    session = Session.open(folder)
    still = rest_in(tmp_path / "still", 0.0, 3)
    with pytest.raises(InputError, match="shows 1 position, and the recording 9"):
        open_simulator_output(still, (session.block, session.about))
    resting = Session.open(still)
    with pytest.raises(InputError, match="shows 9 positions, and the recording 1"):
        open_simulator_output(folder, (resting.block, resting.about))


@pytest.mark.parametrize("stated", [True, False])
def test_a_file_of_a_device_that_never_turns_is_refused(
    tmp_path: Path, folder: Path, stated: bool
) -> None:
    """It rests at all times of the recording, so that its times tell nothing."""
    session = Session.open(folder)
    positions = tuple(
        p if stated else replace(p, alpha=None, beta=None) for p in session.positions
    )
    rest = strapdown.outputs(NOISE)
    place = strapdown.schedule()[0]
    held = rest[(rest[:, 0] > place["start_s"]) & (rest[:, 0] < place["end_s"])]
    rest[:, 1:] = held[np.arange(len(rest)) % len(held), 1:]
    path = write_csv(tmp_path / "still.csv", rest)
    real = (session.block, replace(session.about, positions=positions))
    with pytest.raises(InputError, match=r"still.csv: shows 1 position, and the rec"):
        open_simulator_output(path, real)


def test_two_devices_at_rest_are_compared(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    real = rest_in(tmp_path / "real", 0.01, 4)
    sim = rest_in(tmp_path / "sim", 0.0, 5)
    assert main(["diagnose", str(real), "--against", str(sim)]) == 1
    assert "no common motion" not in capsys.readouterr().err
    found = json.loads((real / "against.json").read_text())
    assert [d["id"] for d in found["differences"]] == ["gyr_bias"]
    off = found["differences"][0]["parameters"]["y"]["difference"]
    assert abs(off["value"] - 0.01) < 3 * off["sigma"]
    assert off["sigma"] < 5e-4


@pytest.mark.thorough
def test_the_command_writes_shows_and_ends_with_what_it_found(
    tmp_path: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table = strapdown.outputs({**NOISE, "seed": 5})
    table[:, 3] += 0.1
    off = write_csv(tmp_path / "off.csv", table)
    assert main(["diagnose", str(folder), "--against", str(off), "--details"]) == 1
    shown = capsys.readouterr().out
    assert "acc bias" in shown and "-0.10" in shown and "Where it shows" in shown
    told = json.loads((folder / "against.json").read_text())
    assert told["against"] == str(off) and told["verdict"] == "left_out"
    assert told["prediction"]["before"]["chi2_per_dof"] > 10
    assert not (folder / "diagnosis.json").exists()


@pytest.mark.parametrize(
    "more", [["--patch", "json"], ["--limit", "noise=1"], ["--junit", "x.xml"]]
)
def test_what_needs_a_simulator_says_so(
    folder: Path, more: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["diagnose", str(folder), *more]) == 2
    assert "need --against" in capsys.readouterr().err


def test_a_twin_and_a_simulator_are_two_questions(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    call = ["diagnose", str(folder), "--against", "x.csv", "--twin", "y.toml"]
    assert main(call) == 2
    assert "--twin or --against" in capsys.readouterr().err
