"""Recordings of others, taken through the command line as a user would."""

from __future__ import annotations

import json
import shutil
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fieldcal.cli import main

UNITS = range(5)

NORM_RESIDUAL = [0.0017, 0.0022, 0.0022, 0.0015, 0.0032]
"""Norm residual once non-orthogonality is modelled, m/s^2: the README of the data."""

IMPORT = ["--columns", "ax,ay,az,gx,gy,gz", "--rate", "100", "--gravity", "9.81"]
"""9.81 m/s^2 is the gravity that the peer's own cost function takes."""


HAND = ["--still", "2.5"]
"""Held by hand: shorter stops are shaky."""


def solve(folder: Path, *options: str) -> dict[str, Any]:
    assert main(["solve", str(folder), "--json", *options]) in (0, 1)
    result: dict[str, Any] = json.loads((folder / "result.json").read_text())
    return result


def both(result: dict[str, Any], group: str) -> tuple[np.ndarray, np.ndarray]:
    found = result["parameters"][group]
    return np.array(found["value"], float), np.array(found["sigma"], float)


@pytest.fixture(scope="module")
def solved(
    shared: Path, tmp_path_factory: pytest.TempPathFactory
) -> list[dict[str, Any]]:
    results = []
    for i in UNITS:
        folder = tmp_path_factory.mktemp("mikoff") / "session"
        log = shared / "real" / "mikoff_mpu9150_x5" / f"imu{i}.log.gz"
        assert main(["import", str(log), *IMPORT, *HAND, "-o", str(folder)]) == 0
        results.append(solve(folder, "--cross"))
    return results


@pytest.mark.parametrize("i", UNITS)
def test_five_mpu9150_leave_no_more_than_the_peer_s_model(
    solved: list[dict[str, Any]], i: int
) -> None:
    assert solved[i]["method"] == "scalar" and solved[i]["verdict"] == "good"
    assert solved[i]["fit"]["rms"] <= NORM_RESIDUAL[i]


@pytest.mark.parametrize("i", UNITS)
def test_five_mpu9150_agree_with_the_peer_s_published_table(
    solved: list[dict[str, Any]], shared: Path, i: int
) -> None:
    """The peer gives no uncertainty; half a unit of its last digit is added to ours."""
    path = shared / "real" / "mikoff_mpu9150_x5" / "peer_results.toml"
    peer = tomllib.loads(path.read_text())["accelerometer"]
    theirs = {
        "acc_bias": [peer[f"bias_{a}"][i] for a in "xyz"],
        "acc_scale": [1 + peer[f"scale_percent_{a}"][i] / 100 for a in "xyz"],
        "cross_coupling": np.deg2rad(
            [peer[f"m_{p}_deg"][i] for p in ("xy", "xz", "yz")]
        ),
    }
    rounding = {"acc_bias": 5e-4, "acc_scale": 5e-6, "cross_coupling": 9e-6}
    for group, published in theirs.items():
        value, sigma = both(solved[i], group)
        off = value - published
        allowed = 3 * np.hypot(sigma, rounding[group])
        assert (np.abs(off) <= allowed).all(), (
            f"unit {i}, {group}: ours - peer = {off}, 3 sigma = {allowed}"
        )


@pytest.mark.parametrize(
    ("name", "method", "offset"),
    [
        ("p10", "two_position", None),
        ("p09", "joint", "angle_offset"),
        ("p01", "joint", None),
        ("p03", "joint", "angle_offset"),
        ("p04", "joint", "base_tilt"),
    ],
)
def test_practice_sessions_are_solved_within_the_stated_uncertainty(
    shared: Path, tmp_path: Path, name: str, method: str, offset: str | None
) -> None:
    folder = tmp_path / name
    shutil.copytree(shared / "practice" / name, folder)
    folder.chmod(0o755)
    answers = json.loads((shared / "practice" / "answers.json").read_text())[name]
    result = solve(folder)
    assert result["method"] == method and result["verdict"] == "good"
    pulls = []
    for group in ("acc_bias", "acc_scale", "gyr_bias"):
        value, sigma = both(result, group)
        pulls.append((value - answers["truth"][group]) / sigma)
    if offset:
        value, sigma = both(result, offset)
        pulls.append((value - list(answers["concealed"][offset].values())) / sigma)
    assert np.abs(np.concatenate(pulls)).max() < 3.5
    assert np.sqrt(np.mean(np.concatenate(pulls) ** 2)) < 1.8


def test_ten_short_intervals_have_next_to_no_freedom_and_that_is_said(
    shared: Path, tmp_path: Path
) -> None:
    log = shared / "real" / "tomisuarez_mpu6050" / "example_data_calibration.csv.gz"
    call = ["import", str(log), *IMPORT, "-o", str(tmp_path / "s"), "--still", "0.3"]
    call += ["--acc-unit", "g", "--acc-lsb", "16384"]
    call += ["--gyr-unit", "deg/s", "--gyr-lsb", "131"]
    assert main(call) == 0
    session = tomllib.loads((tmp_path / "s" / "session.toml").read_text())
    assert session["position"]
    code = main(["solve", str(tmp_path / "s"), "--json", "--cross"])
    if code != 2:
        result = json.loads((tmp_path / "s" / "result.json").read_text())
        assert "degree" in " ".join(result["warnings"])
