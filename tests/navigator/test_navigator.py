"""Calibration from a navigator's drift, against a mechanisation of its own."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.concealed.drifting import FACES, LATITUDE_DEG, G, Sensors, axes, record
from benchmarks.concealed.mechanisation import OMEGA, navigated
from benchmarks.concealed.navigators import NAVIGATORS
from fieldcal.calibration import Calibration
from fieldcal.cli import main
from fieldcal.core.errors import InputError
from fieldcal.navigator.growth import error_dynamics, propagate_errors
from fieldcal.navigator.large_angles import beyond_first_order
from fieldcal.navigator.session_runs import calibrate_navigator
from fieldcal.navigator.solution import read_solution, runs_in_windows
from fieldcal.session import description_file

EXACT = Sensors(np.zeros(3), np.ones(3), np.zeros(3))


def solved(folder: Path, **how: Any) -> tuple[Calibration, Sensors]:
    rng = np.random.default_rng(how.pop("seed", 1))
    sensors = how.pop("sensors", None) or Sensors.drawn(rng)
    record(folder, sensors, rng, **how)
    about = description_file.read_description(folder / "session.toml")
    return calibrate_navigator(folder, about), sensors


@pytest.fixture(scope="module")
def usual(tmp_path_factory: pytest.TempPathFactory) -> tuple[Calibration, Sensors]:
    """Six runs at a set-up that is as stated."""
    tilt = np.array([0.03, 0.6, -0.02])
    return solved(tmp_path_factory.mktemp("usual"), tilt_deg=tilt, seed=9)


def pulls(found: Calibration, sensors: Sensors) -> list[float]:
    out = []
    for name in found.names:
        group, axis = name.split(".")
        true = sensors.truth[group]["xyz".index(axis)]
        out.append((found.value(name) - true) / found.uncertainty(name))
    return out


@pytest.mark.parametrize("attitude", [(0, 0), (90, 0), (30, -60)])
def test_errors_grow_as_in_a_navigator_in_other_axes(attitude: tuple[int, int]) -> None:
    """Small and large errors; Coriolis, Schuler and gravity's fall with height too."""
    phi, n, dt = np.deg2rad(LATITUDE_DEG), 6000, 0.05
    earth = OMEGA * np.array([0.0, -np.sin(phi), np.cos(phi)])
    c = axes(*attitude).T
    bias, drift = np.array([0.02, -0.01, 0.03]), np.array([2e-4, -1e-4, 1.5e-4])
    began = np.array([1e-3, -0.15, 5e-4])
    true = Rotation.from_rotvec(began).as_matrix() @ c
    force = true.T @ [0.0, -G, 0.0] + bias
    v, p = navigated(
        np.tile(true.T @ earth + drift, (n, 1)), np.tile(force, (n, 1)), dt, c, phi, G
    )
    grown = propagate_errors(error_dynamics(earth, G), n * dt / 24, 24)
    both = np.concatenate([c @ drift, c @ bias])
    linear = grown.constant @ both + grown.start[:, :, :3] @ began
    errors = np.concatenate([drift, bias, began])
    inputs = (earth, np.array([0.0, -G, 0.0]))
    more = beyond_first_order(n * dt / 24, 24, c, inputs, errors)
    expected = linear[:, 3:] + more
    there = np.hstack([v, p])[n // 24 - 1 :: n // 24]
    scale = np.repeat([np.abs(v).max(), np.abs(p).max()], 3)
    assert np.abs((expected - there) / scale).max() < 4e-3
    assert np.abs((linear[:, 3:] - there) / scale).max() > 2e-2  # more is needed


def test_noise_grows_as_that_of_many_runs() -> None:
    phi, n, dt = np.deg2rad(LATITUDE_DEG), 120, 0.5
    rng = np.random.default_rng(2)
    earth = OMEGA * np.array([0.0, -np.sin(phi), np.cos(phi)])
    ends = []
    for _ in range(150):
        rates = earth + 1e-4 / np.sqrt(dt) * rng.standard_normal((n, 3))
        forces = [0, -G, 0] + 2e-3 / np.sqrt(dt) * rng.standard_normal((n, 3))
        v, p = navigated(rates, forces, dt, np.eye(3), phi, G)
        ends.append(np.concatenate([v[-1], p[-1]]))
    grown = propagate_errors(error_dynamics(earth, G), n * dt / 4, 4)
    whole = 1e-8 * grown.rate_noise + 4e-6 * grown.force_noise
    sigma = np.sqrt(np.diag(whole)[-6:])
    ratio = np.std(ends, axis=0) / sigma
    assert np.all((ratio > 0.8) & (ratio < 1.2)), ratio


@pytest.mark.statistical
@pytest.mark.parametrize("runs", [2, pytest.param(12, marks=pytest.mark.thorough)])
def test_parameters_are_as_uncertain_as_is_said(
    tmp_path: Path, usual: tuple[Calibration, Sensors], runs: int
) -> None:
    every, rng, some = [], np.random.default_rng(3), [usual]
    for seed in range(1, runs):
        tilt = rng.normal(0, [0.02, 0.5, 0.02])
        some.append(solved(tmp_path / str(seed), seed=seed, tilt_deg=tilt))
    for found, sensors in some:
        assert len(found.names) == 9
        assert found.vector("gyr_bias")[1].max() < 1e-5
        assert found.vector("acc_bias")[1].max() < 2e-3
        every += pulls(found, sensors)
    assert 0.7 < np.sqrt(np.mean(np.square(every))) < 1.3
    assert np.abs(every).max() < 4.5


@pytest.mark.thorough
@pytest.mark.parametrize(
    "name",
    [
        "navigator, azimuth",
        pytest.param("navigator, level", marks=pytest.mark.thorough),
        pytest.param("navigator, one attitude", marks=pytest.mark.thorough),
        pytest.param("navigator, sway", marks=pytest.mark.thorough),
    ],
)
def test_a_set_up_that_is_not_as_stated_is_named(name: str) -> None:
    """And what the sensors are is right with it."""
    found = NAVIGATORS[name](np.random.default_rng(7)).outcome(7)
    assert found.right and not found.extra, found.named
    assert len(found.pulls) >= 9 and max(map(abs, found.pulls.values())) < 4.5


def test_a_set_up_that_is_as_stated_is_not_doubted(
    usual: tuple[Calibration, Sensors],
) -> None:
    found, _ = usual
    assert not found.info["navigator"]["contradicted"]
    assert len(found.warnings) == 1  # what a run at rest hardly shows


def test_noise_is_found_in_the_drift(usual: tuple[Calibration, Sensors]) -> None:
    found, sensors = usual
    told = found.info["navigator"]
    assert 0.5 < told["force_noise_m_s2_rthz"] / sensors.force_noise < 2
    assert 0.5 < told["rate_noise_rad_s_rthz"] / sensors.rate_noise < 2
    assert 0.5 < told["velocity_noise_m_s"] / 1e-3 < 2
    assert told["runs"] == 6 and not told["missing"]


def test_noise_of_positions_is_not_that_of_velocities(tmp_path: Path) -> None:
    """Positions of 5 cm say little more than velocities of 2 mm/s, and harm nothing."""
    noise = np.repeat([2e-3, 5e-2], 3)
    quiet = Sensors(np.full(3, 0.01), np.ones(3), np.full(3, 1e-5), 1e-5, 1e-7)
    how: dict[str, Any] = {"sensors": quiet, "faces": FACES[:2], "out_noise": noise}
    alone, _ = solved(tmp_path / "v", **how)
    both, _ = solved(
        tmp_path / "vp", columns=("vn", "ve", "vd", "pn", "pe", "pd"), **how
    )
    told = both.info["navigator"]
    assert 0.7 < told["velocity_noise_m_s"] / 2e-3 < 1.4
    assert 0.7 < told["position_noise_m"] / 5e-2 < 1.4
    assert alone.info["navigator"]["position_noise_m"] is None
    assert both.uncertainty("gyr_bias.x") < 1.2 * alone.uncertainty("gyr_bias.x")
    assert np.abs(pulls(both, quiet)).max() < 4


def test_a_base_that_points_elsewhere(tmp_path: Path) -> None:
    found, sensors = solved(tmp_path, azimuth_deg=70.0, faces=FACES[:3])
    assert np.abs(pulls(found, sensors)).max() < 4


@pytest.mark.parametrize(
    "columns",
    [
        ("pn", "pe", "pd"),
        pytest.param(("vn", "ve", "vd", "pd"), marks=pytest.mark.thorough),
    ],
)
def test_positions_serve_as_well(tmp_path: Path, columns: tuple[str, ...]) -> None:
    found, sensors = solved(tmp_path, columns=columns)
    assert len(found.names) == 9 and np.abs(pulls(found, sensors)).max() < 4


def test_what_one_attitude_cannot_tell_is_not_said(tmp_path: Path) -> None:
    found, sensors = solved(tmp_path, faces=FACES[:1])
    assert "acc_scale.y" not in found.names  # of y there is bias and scale factor
    assert {"gyr_bias.x", "gyr_bias.z"} <= set(found.names)
    assert any("not determined by these runs" in w for w in found.warnings)
    assert np.abs(pulls(found, sensors)).max() < 4


def test_without_the_vertical_velocity_levels_carry_it(tmp_path: Path) -> None:
    found, sensors = solved(tmp_path, columns=("vn", "ve"))
    assert np.abs(pulls(found, sensors)).max() < 4
    assert not set(found.groups) & {"acc_scale"}


def test_a_navigator_that_levelled_itself_hides_its_accelerometers(
    tmp_path: Path,
) -> None:
    found, sensors = solved(tmp_path, aligned="itself", faces=FACES[:3])
    assert any("found its level by its own" in w for w in found.warnings)
    assert np.abs(pulls(found, sensors)).max() < 4
    assert found.vector("gyr_bias")[1][0] < 1e-4


def test_the_command_writes_a_result_that_others_take(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rng = np.random.default_rng(4)
    record(tmp_path, Sensors.drawn(rng), rng, faces=FACES[:2])
    assert main(["navigator", str(tmp_path), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said == json.loads((tmp_path / "result.json").read_text())
    assert Calibration.from_json(said).names == tuple(said["covariance"]["names"])
    assert main(["navigator", str(tmp_path)]) == 0
    assert "gyro bias x" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("file", "content", "says"),
    [
        ("solution.csv", "time,vn\n0,0\n", "no heading with t and one of"),
        ("solution.csv", "t,vn\n0,0\n1,x\n", "line 3 is not 2 numbers"),
        ("solution.csv", "t,vn\n\n0,0\n\n1,x\n", "line 5 is not 2 numbers"),
        ("solution.csv", "t,vn\n0,0\n1,nan\n", "line 3 has a number that is none"),
        (
            "solution.csv",
            "t,vn\n1,0\n0,0\n",
            "line 3: t does not ascend, it is 0 s beh",
        ),
        ("solution.csv", "t,vn\n1,0\n", "has 1 lines of numbers"),
        ("solution.csv", "t,vn\n0,0\n5,0\n", "must lie within 0 to 5 s"),
        ("solution.csv", "", "no heading"),
        ("session.toml", "[[position]]\nstart_s=0\nend_s=9", "the attitude of its run"),
        (
            "session.toml",
            "[[position]]\nalpha_deg=0\nbeta_deg=0\nstart_s=0\nend_s=90",
            "latitude_deg is lacking",
        ),
        (
            "session.toml",
            "[site]\nlatitude_deg=5\n[[position]]\nalpha_deg=0\nbeta_deg=0",
            "has no start_s",
        ),
        ("session.toml", "[navigator]\naligned='well'", "aligned"),
    ],
)
def test_what_cannot_be_used_is_refused(
    tmp_path: Path, file: str, content: str, says: str
) -> None:
    record(tmp_path, EXACT, np.random.default_rng(1), faces=FACES[:1], seconds=20.0)
    (tmp_path / file).write_text(content)
    with pytest.raises(InputError, match=says):
        calibrate_navigator(
            tmp_path, description_file.read_description(tmp_path / "session.toml")
        )


def test_a_solution_that_is_not_there_is_told_with_where_to_name_it(
    tmp_path: Path,
) -> None:
    with pytest.raises(InputError, match=r"is not there: .*\[navigator\] solution"):
        read_solution(tmp_path / "solution.csv")


def test_a_solution_saved_by_a_spreadsheet_is_read(tmp_path: Path) -> None:
    """It begins with a byte order mark."""
    path = tmp_path / "solution.csv"
    path.write_text("t,vn\n0,0\n20,1\n", encoding="utf-8-sig")
    solution = read_solution(path)
    assert solution.t.tolist() == [0.0, 20.0] and solution.recorded_columns == [2]
    for window in ((0.0, np.nan), (np.nan, 20.0)):
        with pytest.raises(InputError, match="must lie within 0 to 20 s"):
            runs_in_windows(solution, [window])


def test_one_level_velocity_does_not_turn_with_the_azimuth(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    record(tmp_path, EXACT, rng, faces=FACES[:1], columns=("vn",), azimuth_deg=9.0)
    with pytest.raises(InputError, match="has one of them"):
        calibrate_navigator(
            tmp_path, description_file.read_description(tmp_path / "session.toml")
        )
