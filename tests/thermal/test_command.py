"""`fieldcal temperature`, and what it says at GO."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from session_folders import write_session
from thermal_devices import Warming, drawn, exact, session

from fieldcal.acceptance.temperature import effect_of_temperature_change
from fieldcal.calibration import Calibration, limits
from fieldcal.cli import main
from fieldcal.core.samples import Block
from fieldcal.evaluation.observations import observe
from fieldcal.history.store import HistoryRun
from fieldcal.session.folder import RESULT, Session
from fieldcal.sim_device.profile import Climate, NoiseFigures, Profile, Truth
from fieldcal.sim_device.replay import simulate
from fieldcal.solve import solve

BOUNDS = limits.read("tactical")
WARM = (2.0, 14.0, 27.0, 38.0, 49.0)
LADDER = ((0, 0), (90, 0), (180, 0), (-90, 0), (0, 90), (0, -90))


def virtual(folder: Path, of: Warming, temperature: float, seed: int) -> str:
    """A session of a virtual device at a temperature, solved."""
    true = {n: tuple(v.tolist()) for n, v in of.values(temperature).items()}
    noise = NoiseFigures(acc_instability=(0.0,) * 3, gyr_instability=(0.0,) * 3)
    climate = Climate(ambient_c=temperature, self_heating_k=0.0)
    profile = Profile(truth=Truth(**true), noise=noise, temperature=climate)
    windows = [
        (np.deg2rad(a), np.deg2rad(b), 20.0 * i + 6, 20.0 * i + 18)
        for i, (a, b) in enumerate(LADDER)
    ]
    block = simulate(profile, windows, seed=seed)
    positions = [
        {"alpha_deg": float(a), "beta_deg": float(b), "start_s": s, "end_s": e}
        for (a, b), (_, _, s, e) in zip(LADDER, windows, strict=True)
    ]
    site = {"latitude_deg": 50.45, "height_m": 170.0}
    write_session(folder, block, positions, site=site, device={"serial": "SIM-1"})
    recorded = Session.open(folder)
    recorded.write_json(RESULT, solve(observe(recorded)[0]).to_json())
    return str(folder)


def test_virtual_sessions_at_several_temperatures_become_one_model(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    of = drawn(np.random.default_rng(21))
    every = [virtual(tmp_path / f"s{i}", of, t, i) for i, t in enumerate(WARM)]
    capsys.readouterr()
    out = tmp_path / "model.json"
    assert main(["temperature", *every, "--at", "33", "--json", "-o", str(out)]) == 0
    said = json.loads(capsys.readouterr().out)
    assert json.loads(out.read_text()) == said
    pulls = []
    for name, found in said["at"]["parameters"].items():
        group, axis = name.split(".")
        if group in of.coefficients:
            true = of.values(33.0)[group]["xyz".index(axis)]
            pulls.append((found["value"] - true) / found["sigma"])
    assert len(pulls) == 9 and np.abs(pulls).max() < 4
    change = said["at"]["change"]["acc_bias.x"]
    true = of.values(33.0)["acc_bias"][0] - of.values(49.0)["acc_bias"][0]
    assert abs(change["change"] - true) < 4 * change["sigma"]
    assert main(["temperature", *every, "--at", "33"]) == 0
    shown = capsys.readouterr().out
    assert "5 sessions at 2.0 to 49.0 °C" in shown and "a level wrong by" in shown
    assert main(["temperature", *every, "--at", "60"]) == 2
    assert "beyond the sessions" in capsys.readouterr().err


@pytest.mark.parametrize("number", ["-1", "x", "5"])
def test_a_sensor_that_no_autopilot_has_is_refused(
    number: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Not written as INS_ACC0OFFS."""
    assert main(["temperature", "a", "b", "c", f"--instance={number}"]) == 2
    assert "is no number from 0 to 4" in capsys.readouterr().err


def at(of: Warming, temperature: float, serial: str = "A1") -> Calibration:
    covariance = exact(of)
    return session(of, temperature, np.zeros(len(covariance)), covariance, serial)


def test_a_session_counts_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A copy of one: its ± would be that of two that agree, and ten times too small."""
    of, rng = drawn(np.random.default_rng(1)), np.random.default_rng(2)
    covariance = exact(of)
    paths = [tmp_path / name for name in ("a.json", "b.json", "c.json", "copy.json")]
    for path, t in zip(paths, (5, 20, 40, 5), strict=True):
        error = np.sqrt(np.diag(covariance)) * rng.standard_normal(len(covariance))
        found = session(of, t, error, covariance)
        path.write_text(json.dumps(found.to_json()))
    assert main(["temperature", *map(str, paths)]) == 0
    paths[3].write_text(paths[0].read_text())
    assert main(["temperature", *map(str, paths)]) == 2
    said = capsys.readouterr().err
    assert f"{paths[0]} and {paths[3]} are the same calibration" in said


def test_a_run_and_its_copy_made_before_it_was_continued_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Their calibrations differ, and are no two of the device."""
    of, rng = drawn(np.random.default_rng(1)), np.random.default_rng(2)
    block = Block.of(np.arange(90) / 10, *rng.normal(size=(2, 90, 3)))
    paths = []
    for i, (t, count) in enumerate([(5, 60), (20, 90), (40, 90)]):
        samples = block[:count] if i < 2 else replace(block, t=block.t + 1e3)
        about = {"recording": {"id": "7f"}}
        paths.append(write_session(tmp_path / str(i), samples, [], **about))
        result = json.dumps(at(of, t).to_json())
        (paths[-1] / "result.json").write_text(result)
    assert main(["temperature", *map(str, paths)]) == 2
    said = capsys.readouterr().err
    assert f"{paths[1]}: has samples of {paths[0]}: give each recording once" in said


def test_sessions_of_two_devices_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    of = drawn(np.random.default_rng(1))
    paths = []
    for i, (t, serial) in enumerate([(5, "A1"), (20, "A1"), (40, "B2")]):
        paths.append(tmp_path / f"{i}.json")
        paths[-1].write_text(json.dumps(at(of, t, serial).to_json()))
    assert main(["temperature", *map(str, paths)]) == 2
    assert "give sessions of one device" in capsys.readouterr().err


def test_a_session_that_disagrees_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    of = drawn(np.random.default_rng(1))
    paths = []
    for i, t in enumerate((2.0, 9.0, 16.0, 23.0, 30.0, 37.0, 44.0, 50.0)):
        found = at(of, t)
        values = found.values + (0.5 if i == 4 else 0.0) * (found.units[0] == "m/s^2")
        paths.append(tmp_path / f"{i}.json")
        paths[-1].write_text(json.dumps(replace(found, values=values).to_json()))
    assert main(["temperature", *map(str, paths)]) == 1
    assert "4.json at 30.0 °C" in capsys.readouterr().err


def run(number: int, found: Calibration) -> HistoryRun:
    at_, warm = f"2026-03-0{number}T10:00:00", found.info["conditions"]
    celsius = warm["temperature_degc"]
    return HistoryRun(
        number, "A1", at_, f"/s/{number}", True, False, celsius, 50.0, 0.0, "", found
    )


def test_at_go_the_difference_of_temperature_is_told_by_the_history() -> None:
    of = drawn(np.random.default_rng(9))
    earlier = [run(i + 1, at(of, t)) for i, t in enumerate((3.0, 46.0, 25.0, 12.0))]
    told = effect_of_temperature_change(at(of, 36.0), earlier, BOUNDS)
    assert told is not None and told["then_degc"] == 12.0 and told["now_degc"] == 36.0
    for name, change in told["parameters"].items():
        group, axis = name.split(".")
        now, then = (of.values(t)[group]["xyz".index(axis)] for t in (36.0, 12.0))
        assert abs(change["change"] - (now - then)) < 4 * change["sigma"]
    (says,) = told["says"]
    assert "36.0 °C now, 12.0 °C at the calibration of 2026-03-04" in says
    assert "acc bias" in says and "a level wrong by" in says and "±" in says


def test_without_enough_history_it_is_said_that_nobody_knows() -> None:
    of = drawn(np.random.default_rng(9))
    told = effect_of_temperature_change(at(of, 36.0), [run(1, at(of, 12.0))], BOUNDS)
    assert told is not None and told["parameters"] is None
    assert "three calibrations over at least 10 K" in told["says"][0]
    assert (
        effect_of_temperature_change(at(of, 12.5), [run(1, at(of, 12.0))], BOUNDS)
        is None
    )
    assert effect_of_temperature_change(at(of, 36.0), [], BOUNDS) is None
    unknown = replace(at(of, 36.0), info={})
    assert effect_of_temperature_change(unknown, [run(1, at(of, 12.0))], BOUNDS) is None
