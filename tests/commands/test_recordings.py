"""Recordings of others, taken through the command line as a user would."""

from __future__ import annotations

import json
import shutil
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares

from fieldcal.cli import main
from fieldcal.session.folder import Session

UNITS = [pytest.param(i, marks=pytest.mark.thorough) for i in range(5)]
"""Each by the command line; in every run all are in test_scalar and test_turns."""

NORM_RESIDUAL = [0.0017, 0.0022, 0.0022, 0.0015, 0.0032]
"""Norm residual once non-orthogonality is modelled, m/s^2: the README of the data."""

IMPORT = ["--columns", "ax,ay,az,gx,gy,gz", "--rate", "100", "--gravity", "9.81"]
"""9.81 m/s^2 is the gravity that the peer's own cost function takes."""


HAND = ["--still", "2"]
"""Held by hand: shorter stops are shaky."""


def solve(folder: Path, *options: str) -> dict[str, Any]:
    assert main(["solve", str(folder), "--json", *options]) in (0, 1)
    result: dict[str, Any] = json.loads((folder / "result.json").read_text())
    return result


def both(result: dict[str, Any], group: str) -> tuple[np.ndarray, np.ndarray]:
    found = result["parameters"][group]
    return np.array(found["value"], float), np.array(found["sigma"], float)


@dataclass(frozen=True)
class Unit:
    """One of five devices: its session, and the result."""

    folder: Path
    result: dict[str, Any]


@pytest.fixture(scope="module")
def units(
    shared: Path, tmp_path_factory: pytest.TempPathFactory
) -> Callable[[int], Unit]:
    """Import and solve a unit; each once, however often it is asked for."""

    @cache
    def made(i: int) -> Unit:
        folder = tmp_path_factory.mktemp("mikoff") / "session"
        log = shared / "real" / "mikoff_mpu9150_x5" / f"imu{i}.log.gz"
        assert main(["import", str(log), *IMPORT, *HAND, "-o", str(folder)]) == 0
        return Unit(folder, solve(folder, "--cross"))

    return made


@pytest.mark.parametrize("i", UNITS)
@pytest.mark.thorough
def test_five_mpu9150_leave_no_more_than_the_peer_s_model(
    units: Callable[[int], Unit], i: int
) -> None:
    solved = units(i).result
    assert solved["method"] == "scalar"
    assert solved["verdict"] == "good"
    half_a_digit = 0.00005
    # theirs is the least there is; ours weighs the stops, fits the turns as well, and
    # what a device with such biases may have besides, hysteresis and a warm-up, is not
    # in its parameters; and stops are means without what a hand pushed
    assert solved["fit"]["rms"] <= 1.2 * NORM_RESIDUAL[i] + half_a_digit
    assert solved["quadratic_sigma"] == 2e-5  # the stops show it: not 2.5e-4


@pytest.mark.parametrize("i", UNITS)
@pytest.mark.thorough
def test_five_mpu9150_are_explained(
    units: Callable[[int], Unit], i: int, capsys: pytest.CaptureFixture[str]
) -> None:
    """Hands turn them in all rests, and shake them in some; no function of time."""
    folder = units(i).folder
    capsys.readouterr()
    assert main(["diagnose", str(folder), "--json"]) == 1
    said = json.loads(capsys.readouterr().out)
    assert said["verdict"] in ("left_out", "ambiguous")
    found = {effect["id"]: effect for effect in said["effects"]}
    assert {"cross_coupling", "quantisation"} <= set(found)
    assert (
        said["fit"]["after"]["held_out_rms"]
        < 0.9 * (said["fit"]["before"]["held_out_rms"])
    )


def stops_without_weights(folder: Path) -> np.ndarray:
    """Mean specific force of each stop, (n, 3), as anybody would take it."""
    session = Session.open(folder)
    spans = [w for w in session.windows if w]
    return np.array([session.block.between(*w).acc.mean(axis=0) for w in spans])


def norms_of_the_peer_s_model(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    matrix = np.array([[x[3], x[6], x[7]], [0, x[4], x[8]], [0, 0, x[5]]])
    f = np.linalg.solve(matrix, (y - x[:3]).T)
    return np.asarray(np.linalg.norm(f, axis=0) - 9.81)


@pytest.mark.parametrize("i", UNITS)
def test_five_mpu9150_predict_a_stop_left_out_as_well_as_plain_least_squares(
    units: Callable[[int], Unit], i: int
) -> None:
    """The peer's model and method, on the same stops: nine numbers, equal weights."""
    unit = units(i)
    y = stops_without_weights(unit.folder)
    assert len(y) == unit.result["conditions"]["positions"]
    ideal = np.array([0, 0, 0, 1, 1, 1, 0, 0, 0], float)
    near = least_squares(norms_of_the_peer_s_model, ideal, args=(y,), xtol=1e-14).x
    missed = []
    for k in range(len(y)):
        others = np.delete(y, k, axis=0)
        fit = least_squares(norms_of_the_peer_s_model, near, args=(others,), xtol=1e-14)
        missed.append(norms_of_the_peer_s_model(fit.x, y[k : k + 1])[0])
    assert unit.result["left_out_rms"] <= 1.01 * np.sqrt(np.mean(np.square(missed)))


@pytest.mark.parametrize("i", UNITS)
def test_five_mpu9150_agree_with_the_peer_s_published_table(
    units: Callable[[int], Unit], shared: Path, i: int
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
        value, sigma = both(units(i).result, group)
        off = value - published
        allowed = 3 * np.hypot(sigma, rounding[group])
        assert (np.abs(off) <= allowed).all(), (
            f"unit {i}, {group}: ours - peer = {off}, 3 sigma = {allowed}"
        )


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("name", "method", "offset"),
    [
        ("p10", "two_position", None),
        pytest.param("p09", "joint", "angle_offset", marks=pytest.mark.thorough),
        pytest.param("p01", "joint", None, marks=pytest.mark.thorough),
        pytest.param("p03", "joint", "angle_offset", marks=pytest.mark.thorough),
        pytest.param("p04", "joint", "base_tilt", marks=pytest.mark.thorough),
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


@pytest.mark.thorough
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


@pytest.mark.thorough
@pytest.mark.parametrize("i", UNITS)
def test_diagnose_says_of_crooked_axes_what_solve_finds(
    units: Callable[[int], Unit], i: int
) -> None:
    """Nobody knows how the stops stood: they tell k12 + k21 and so on alone.

    The coupling of the gyroscopes is told in the axes of that sum by both commands.
    """
    unit = units(i)
    assert main(["diagnose", str(unit.folder)]) == 1
    said = json.loads((unit.folder / "diagnosis.json").read_text())
    told = {e["id"]: e["parameters"] for e in said["effects"]}
    assert set(told["cross_coupling"]) <= {"k12", "k13", "k23"}
    for effect, letter, places in (
        ("cross_coupling", "k", (12, 13, 23)),
        ("gyro_cross_coupling", "s", (12, 13, 21, 23, 31, 32)),
    ):
        value, sigma = both(unit.result, effect)
        for place, v, s in zip(places, value, sigma, strict=True):
            if one := told.get(effect, {}).get(f"{letter}{place}"):
                assert 0 < one["sigma"] < 3 * s
                assert abs(one["value"] - v) < 0.75 * np.hypot(one["sigma"], s)
