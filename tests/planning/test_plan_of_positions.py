"""Plans of one's own positions, and of a base that sways."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from fieldcal.cli import main
from fieldcal.planning.planner import GRADES, GradeNoise
from fieldcal.planning.swaying_base import window_seconds_needed

FACES = """
format = 1
[[position]]
rotation_vector_deg = [0.0, 0.0, 0.0]
[[position]]
quaternion = [0.0, 0.0, 0.0, 1.0]
[[position]]
rotation_vector_deg = [0.0, 0.0, 90.0]
[[position]]
rotation_vector_deg = [0.0, 0.0, -90.0]
[[position]]
rotation_vector_deg = [90.0, 0.0, 0.0]
[[position]]
rotation_vector_deg = [-90.0, 0.0, 0.0]
"""

POSITIONS = "".join(
    f"[[position]]\nalpha_deg = {a}.0\nbeta_deg = {b}.0\n"
    for a, b in ((-45, -5), (-45, 5), (0, 0), (45, -5), (45, 5))
)


def planned(
    capsys: pytest.CaptureFixture[str], *words: str
) -> dict[str, dict[str, float]]:
    assert main(["plan", "--json", "--minutes", "6", *words]) == 0
    found: dict[str, dict[str, float]] = json.loads(capsys.readouterr().out)
    return found


def test_attitudes_are_worth_what_their_angles_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Six faces, as one finite turn and as a quaternion."""
    file = tmp_path / "session.toml"
    file.write_text(FACES)
    ours = planned(capsys, "--of", str(tmp_path))["sigma"]
    known = planned(capsys, "--set", "six_faces")["sigma"]
    assert ours == pytest.approx(known, rel=1e-6)


def test_three_angles_are_planned_and_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, plan = tmp_path / "mine.toml", tmp_path / "plan.toml"
    third = "[[position]]\nalpha_deg = 30.0\nbeta_deg = 40.0\ngamma_deg = 50.0\n"
    file.write_text(FACES + third)
    words = ["plan", "--of", str(file), "--sways", "0.2", "-o", str(plan)]
    assert main([*words, "--minutes", "9"]) == 0
    said = capsys.readouterr().out
    assert "sways by 1° at 0.2 Hz each position needs 10 s; this plan has 60 s" in said
    written = tomllib.loads(plan.read_text())
    last = written["position"][-1]
    assert (last["alpha_deg"], last["gamma_deg"]) == (30.0, 50.0)
    assert written["site"]["sways"] is True


def test_uncertainties_are_those_of_the_device_s_axes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A device with z up: its y and z measure what the procedure's -z and y do."""
    file, plan = tmp_path / "session.toml", tmp_path / "plan.toml"
    words = ("--set", "wide")
    level = planned(capsys, *words)["sigma"]
    file.write_text(
        'format = 1\n[frame]\nmounting = ["+x", "-z", "+y"]\n'
        "[site]\ngravity = 9.79\n" + POSITIONS
    )
    for upright in (
        planned(capsys, *words, "--mounting", "+x,-z,+y"),
        planned(capsys, "--of", str(file), "-o", str(plan)),
    ):
        for group in ("acc_bias", "acc_scale"):
            for ours, of_level in ("xx", "yz", "zy"):
                want = pytest.approx(level[f"{group}.{of_level}"], rel=0.01)
                assert upright["sigma"][f"{group}.{ours}"] == want
    assert level["acc_scale.y"] < 0.7 * level["acc_scale.z"]
    written = tomllib.loads(plan.read_text())
    assert written["frame"]["mounting"] == ["+x", "-z", "+y"]
    assert written["site"]["gravity"] == 9.79
    assert written["device"]["grade"] == "tactical"


def test_what_cannot_be_planned_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "table.toml"
    file.write_text("format = 1\n[[position]]\nspeed_deg_s = 20.0\n")
    for words in (["--of", str(file)], ["--of", str(file), "--set", "two"]):
        assert main(["plan", *words]) == 2
    assert main(["plan", "--sways", "0"]) == 2
    assert "above 0" in capsys.readouterr().err
    for names in (["--of", str(file)], ["--set", "two"]):
        assert main(["plan", *names, "--positions", "7"]) == 2
        assert f"{names[0]} names them" in capsys.readouterr().err


def test_slow_swaying_and_little_noise_need_longer_windows() -> None:
    tactical = GRADES["tactical"]
    seconds = [window_seconds_needed(hz, tactical) for hz in (0.5, 0.1, 0.06)]
    assert seconds[0] < seconds[1] < seconds[2]
    assert seconds[1] >= 12.0  # 1.2 periods
    untold = GradeNoise(tactical.acc_white, tactical.acc_floor, np.nan, np.inf)
    assert window_seconds_needed(0.1, untold) <= seconds[1], "of no gyroscopes"
    quiet = GradeNoise(1e-7, 0.0, 1e-9, 0.0)
    assert window_seconds_needed(0.1, quiet) >= seconds[1]
