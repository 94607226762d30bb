"""Recordings of others: what is left out of each is found by name, or honestly not."""

from __future__ import annotations

import gzip
import json
import tomllib
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from functools import cache, partial
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from recordings import hand_held
from scipy.optimize import least_squares
from session_folders import recorded, write_session

from benchmarks.injected.recorded import (
    TEN_MINUTES,
    Held,
    at_rest_for,
    faces_by_rows,
    labelled_faces,
)
from fieldcal.cli import main
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array, Block
from fieldcal.diagnosis.explain import explain
from fieldcal.diagnosis.prepare import prepare_recording
from fieldcal.effects import catalogue
from fieldcal.physics.effect import Motion
from fieldcal.physics.experience import Experience
from fieldcal.session.folder import Session
from fieldcal.sim_device.profile import NoiseFigures, Profile, Truth
from fieldcal.sim_device.vocabulary import parse


def diagnosed(folder: Path) -> dict[str, Any]:
    """What diagnosis.json says, with the replay on the twin; no warning reached us."""
    out, err = StringIO(), StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = main(
            ["diagnose", str(folder), "--json", "--twin", str(folder / "twin.toml")]
        )
    said: dict[str, Any] = json.loads(out.getvalue())
    assert code == (said["verdict"] != "consistent")
    assert "RuntimeWarning" not in err.getvalue()
    return said


def named(said: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {effect["id"]: effect for effect in said["effects"]}


def written(make: Callable[[], Held], folder: Path) -> Path:
    """A session of a recording that lies beside the project."""
    try:
        block, places = make()
    except FileNotFoundError as error:
        pytest.skip(f"the recording is not here: {error.filename}")
    return write_session(folder, block, places)


@pytest.fixture(scope="module")
def faces(
    tmp_path_factory: pytest.TempPathFactory,
) -> Callable[[Callable[[], Held]], dict[str, Any]]:
    """Diagnose a session of six faces; each once, however often it is asked for."""

    @cache
    def said_of(session: Callable[[], Held]) -> dict[str, Any]:
        return diagnosed(written(session, tmp_path_factory.mktemp("faces") / "s"))

    return said_of


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("session", "before", "after"),
    [(labelled_faces, 0.129, 0.035), (faces_by_rows, 0.078, 0.013)],
)
def test_six_faces_are_not_square(
    session: Callable[[], Held],
    before: float,
    after: float,
    faces: Callable[[Callable[[], Held]], dict[str, Any]],
) -> None:
    """The published residuals with known axes, without and with cross-coupling.

    How well a hand sets faces is estimated along, and explains as much: what
    cross-coupling alone leaves is not what least squares leaves, the least there is.
    """
    said = faces(session)
    assert said["verdict"] in ("left_out", "ambiguous")
    assert "cross_coupling" in named(said)
    assert "gyro_scale" not in named(said)  # nobody held the heading
    fit = said["fit"]
    assert fit["before"]["rms"] == pytest.approx(before, rel=0.05)
    assert fit["after"]["rms"] < 0.9 * before
    assert fit["after"]["held_out_rms"] < 0.95 * fit["before"]["held_out_rms"]
    replay = {k: said["twin"][k]["rms_acceleration"] for k in ("refitted", "twin")}
    assert replay["refitted"] == pytest.approx(before, rel=0.05)
    assert replay["twin"] < 0.6 * before


@pytest.mark.thorough
def test_the_bias_of_six_faces_is_the_peer_s(
    shared: Path, faces: Callable[[Callable[[], Held]], dict[str, Any]]
) -> None:
    said = faces(labelled_faces)
    path = shared / "real" / "imucal_ferraris" / "peer_example_cal.json"
    peer = json.loads(path.read_text())
    ours = said["calibration"]["acc_bias"]
    theirs = np.array(peer["b_a"]) / 2048 * G0
    jump = named(said).get("bias_step", {}).get("parameters", {})
    later = [jump.get(f"a{axis}", {"value": 0.0})["value"] for axis in "xyz"]
    apart = np.array(ours["value"]) + later - theirs
    assert (np.abs(apart) < 3 * np.array(ours["sigma"]) + 0.01).all()


@pytest.mark.parametrize(
    ("message", "left_out"),
    [
        ("RAW_IMU.0", ["quantisation"]),
        pytest.param("HIGHRES_IMU.0", [], marks=pytest.mark.thorough),
    ],
)
@pytest.mark.thorough
def test_whole_milligravities_are_coarse_steps_and_no_bumps(
    message: str,
    left_out: list[str],
    shared: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The same flight as integers and as floats."""
    path = shared / "real" / "autopilot_streams" / "autopilot_12_positions.tlog.gz"
    if not path.is_file():
        pytest.skip(f"the recording is not here: {path}")
    monkeypatch.chdir(tmp_path)
    assert main(["import", str(path)]) == 0
    capsys.readouterr()
    said = diagnosed(tmp_path / "autopilot_12_positions" / message)
    assert list(named(said)) == left_out
    steps = {"acc": 1e-3 * G0, "gyr": 1e-3}  # mg, mrad/s
    for effect in said["effects"]:
        for name, found in effect["parameters"].items():
            assert abs(found["value"] - steps[name]) < 3 * found["sigma"]


@pytest.mark.thorough
def test_an_autopilot_on_the_bench_warms_up(shared: Path, tmp_path: Path) -> None:
    """In a minute nobody tells an exponential of many minutes from a drift: both."""
    pyulog = pytest.importorskip("pyulog", reason="pyulog reads PX4 logs")
    path = shared / "real" / "pyulog_samples" / "sample.ulg.gz"
    if not path.is_file():
        pytest.skip(f"the recording is not here: {path}")
    log = tmp_path / "sample.ulg"
    log.write_bytes(gzip.decompress(path.read_bytes()))
    data = pyulog.ULog(str(log)).get_dataset("sensor_combined").data
    t = data["timestamp"] * 1e-6
    new = np.concatenate([[True], np.diff(t) > 0])
    acc, gyr = (
        np.column_stack([data[f"{name}[{i}]"][new] for i in range(3)])
        for name in ("accelerometer_m_s2", "gyro_rad")
    )
    t = t[new]
    window = {"start_s": float(t[0]) + 9.0, "end_s": float(t[-1])}
    said = diagnosed(write_session(tmp_path / "s", Block.of(t, acc, gyr), [window]))
    found = named(said)
    there = {*found, *(a for effect in found.values() for a in effect["aliases"])}
    assert "warm_up" in there
    slow = found.get("warm_up") or found["bias_drift"]
    assert slow["evidence"]["held_out_gain"] > 0.5
    # gyro y goes from -2.43 to -1.87 mrad/s within the minute
    if slow["id"] == "bias_drift":
        course = slow["parameters"]["gy"]["value"] * (t[-1] - t[0] - 9)
        assert course == pytest.approx(0.56e-3, rel=0.25)
    fit, replays = said["fit"], said["twin"]
    assert fit["after"]["held_out_rms"] < 0.5 * fit["before"]["held_out_rms"]
    assert replays["twin"]["rms_angular_rate"] < (
        0.5 * replays["refitted"]["rms_angular_rate"]
    )


@pytest.mark.thorough
def test_what_is_told_is_the_likeliest_of_all_that_was_looked_at(
    shared: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two walks may stand in the place of two warm-ups, and one of each is likelier."""
    pytest.importorskip("pyulog", reason="pyulog reads PX4 logs")
    path = shared / "real" / "pyulog_samples" / "sample.ulg.gz"
    if not path.is_file():
        pytest.skip(f"the recording is not here: {path}")
    assert main(["import", str(path), "-o", str(tmp_path / "bench")]) == 0
    capsys.readouterr()
    session = Session.open(tmp_path / "bench")
    found = explain(prepare_recording(session.block, session.about))
    likely = dict(found.posterior.weights)
    assert likely[found.inferred.best] == max(likely.values()) > 0.5
    assert {"warm_up", "random_walk"} <= set(named(diagnosed(tmp_path / "bench")))


@pytest.mark.thorough
def test_ten_minutes_on_a_table_follow_a_quarter_of_a_kelvin(tmp_path: Path) -> None:
    pytest.importorskip("h5py", reason="h5py reads these recordings")
    said = diagnosed(written(partial(at_rest_for, TEN_MINUTES), tmp_path / "s"))
    found = named(said)
    assert "temperature_bias" in found
    assert found["temperature_bias"]["evidence"]["held_out_gain"] > 0.5
    assert "dropped" not in found  # stamps in bursts are no lost samples
    fit = said["fit"]
    assert fit["after"]["rms"] < 0.5 * fit["before"]["rms"]
    assert fit["after"]["held_out_rms"] < fit["before"]["held_out_rms"]
    replays = said["twin"]
    assert replays["twin"]["rms_acceleration"] < (
        0.5 * replays["refitted"]["rms_acceleration"]
    )


def test_a_minute_with_broken_stamps_shows_nothing_more(tmp_path: Path) -> None:
    pytest.importorskip("h5py", reason="h5py reads these recordings")
    name = "set-1__unmoved-z-pointing-left"
    said = diagnosed(written(partial(at_rest_for, name), tmp_path / "s"))
    assert said["verdict"] == "consistent"
    assert "degrees of freedom" in " ".join(said["warnings"])


@pytest.mark.thorough
def test_ten_short_intervals_are_not_fitted_with_more(tmp_path: Path) -> None:
    """Nine parameters would "fit" them; none of the accelerometers' is believed."""
    counts, intervals = hand_held()
    t = np.arange(len(counts)) / 100
    block = Block.of(t, counts[:, :3] / 16384 * G0, np.deg2rad(counts[:, 3:] / 131))
    windows = [
        {"start_s": float(t[int(a)]), "end_s": float(t[int(b) - 1])}
        for a, b in intervals.T
    ]
    folder = write_session(tmp_path / "s", block, windows)
    said = diagnosed(folder)
    shapes = {"cross_coupling", "quadratic", "cubic", "scale_asymmetry"}
    assert not shapes & set(named(said))
    why = {c["id"]: c["why"] for c in said["candidates"]}
    assert why["cross_coupling"]


AXES = np.array([1.0, -1.0, -1.0])
"""The axes of the published experiment's device; its y reads +g."""

ANGLE_ERROR = 5e-3
"""m/s^2: an angle of that fixture set to 0.03 degrees, and the tables' own scatter."""


def published(shared: Path, column: int) -> tuple[Array, Array, Experience]:
    """Calibration on a level base, and on a tilted one, (2, 3) each; the positions."""
    path = shared / "paper" / "tables.toml"
    if not path.is_file():
        pytest.skip(f"the tables are not here: {path}")
    tables = tomllib.loads(path.read_text())
    keys = ("dUx0", "dUy0", "dUz0", "dK11", "dK22", "dK33")
    level, tilted = (
        np.array([tables[name][k][column] for k in keys]).reshape(2, 3) + [[0], [1]]
        for name in ("table1", "table2")
    )
    alpha, beta = np.deg2rad(tables["table1"]["positions_deg"]).T
    return level, tilted, Experience.at_rest(alpha, beta, 9.81)


def squares(
    effect: str, level: Array, seen: Array, x: Experience
) -> tuple[Array, float]:
    """Parameters of an effect that make the level device read so, and chi-squared."""
    motion = catalogue()[effect]
    assert isinstance(motion, Motion)

    def off(values: Array) -> Array:
        force = motion.change(x, values).f * AXES
        apart: Array = (level[0] + level[1] * force - seen) / ANGLE_ERROR
        return apart.ravel()

    fit = least_squares(off, np.zeros(2))
    return fit.x, 2 * float(fit.cost)


@pytest.mark.parametrize("column", [0, 2, 3])
def test_a_tilted_base_of_the_published_experiment_is_a_joint_offset(
    shared: Path, column: int
) -> None:
    """Six published numbers from two parameters; a rigid base does not make them."""
    level, tilted, x = published(shared, column)
    force = x.f * AXES
    seen = tilted[0] + tilted[1] * force  # what the device read in the two positions
    before = float((((level[0] + level[1] * force - seen) / ANGLE_ERROR) ** 2).sum())
    offset, after = squares("angle_offset", level, seen, x)
    _, rigid = squares("base_tilt", level, seen, x)
    np.testing.assert_allclose(offset, [1.0, 1.0], atol=0.03)
    assert before > 4000 and after < 9.5 and rigid > 5 * after  # 6, 4 and 4 freedoms
    # and the virtual device at that offset gives the six numbers by its own physics
    truth = Truth(tuple(level[0]), tuple(level[1] * AXES))
    device = Profile(
        truth=truth,
        noise=NoiseFigures(acc=(0, 0, 0), acc_instability=(0, 0, 0)),
        effects=(parse(f"angle_offset:alpha0_deg={offset[0]},beta0_deg={offset[1]}"),),
    )
    places = [
        {"alpha_deg": a, "beta_deg": b, "start_s": s, "end_s": s + 5}
        for a, b, s in ((0.0, 0.0, 1.0), (45.0, 5.0, 20.0))
    ]
    block = recorded(device, places)
    read = np.array(
        [block.between(p["start_s"], p["end_s"]).acc.mean(axis=0) for p in places]
    )
    scale = (read[1] - read[0]) / (force[1] - force[0]) * (9.81 / device.gravity)
    bias = read[0] - scale * force[0]
    np.testing.assert_allclose(bias - level[0], (tilted - level)[0], atol=0.025)
    np.testing.assert_allclose(scale - level[1], (tilted - level)[1], atol=0.008)
