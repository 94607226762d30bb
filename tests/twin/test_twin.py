"""The virtual twin: what is found goes into a device file, and the replay proves it."""

from __future__ import annotations

import json
import re
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from processes import Recalibrated
from session_folders import SITE, places, recorded, windows_of, write_session

from fieldcal.cli import main
from fieldcal.core.positions import FIVE_POSITIONS
from fieldcal.core.samples import Block
from fieldcal.effects import catalogue
from fieldcal.model.state import State, Term
from fieldcal.physics.experience import Experience
from fieldcal.sim_device import profile_file
from fieldcal.sim_device.profile import Climate, NoiseFigures, Profile
from fieldcal.sim_device.replay import simulate
from fieldcal.sim_device.vocabulary import parse
from fieldcal.twin.device import effects_of_terms
from fieldcal.twin.physical import from_one_instant

QUIET = NoiseFigures(acc_instability=(0, 0, 0), gyr_instability=(0, 0, 0))
DEVICE = Profile(noise=QUIET)


def diagnosed(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> tuple[int, dict[str, Any], Profile]:
    """Exit code, diagnosis.json and twin of a session."""
    file = folder / "twin.toml"
    code = main(["diagnose", str(folder), "--twin", str(file), "--json"])
    out, err = capsys.readouterr()
    assert "Warning" not in err
    return code, json.loads(out), profile_file.read_profile(file)


def concealing(
    folder: Path, *effects: str, seed: int = 1, count: int = 9, **more: Any
) -> Path:
    """Write a session of a device with effects, in some of nine positions."""
    device = replace(DEVICE, effects=tuple(map(parse, effects)), **more)
    positions = places()[:count]
    return write_session(folder, recorded(device, positions, seed), positions)


def later(block: Block, seconds: float) -> Block:
    return replace(block, t=block.t + seconds)


@pytest.mark.thorough
@pytest.mark.parametrize(
    "concealed",
    [
        pytest.param(
            "base_tilt:about_x_deg=1,about_z_deg=-0.7", marks=pytest.mark.thorough
        ),
        pytest.param(
            "cross_coupling:k12=0.01,k31=-0.008,k32=0.02", marks=pytest.mark.thorough
        ),
        pytest.param("settling:ax=0.05,az=-0.04,tau_s=5", marks=pytest.mark.thorough),
        pytest.param("settling:ax=0.05,gx=0.003,tau_s=5", marks=pytest.mark.thorough),
        "mounting:axes=+y-x+z",
        pytest.param("stuck:channel=gy,from_s=40,to_s=43", marks=pytest.mark.thorough),
    ],
)
def test_the_replay_with_what_was_found_agrees_with_the_recording(
    concealed: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, said, twin = diagnosed(concealing(tmp_path / "s", concealed), capsys)
    assert code == 1
    replays = said["twin"]
    assert 0.8 < replays["twin"]["chi2_per_dof"] < 1.2
    assert replays["twin"]["chi2_per_dof"] < 0.9 * replays["refitted"]["chi2_per_dof"]
    # two programs' physics, one fit: the windows come out the same
    assert replays["twin"]["chi2_per_dof"] == pytest.approx(
        said["fit"]["after"]["chi2_per_dof"], rel=0.02
    )
    assert twin.one(concealed.partition(":")[0]) is not None
    assert "the twin is" in said["says"] and replays["device"].endswith("twin.toml")
    assert [p["position"] for p in replays["positions"]] == list(range(9))


@pytest.mark.thorough
def test_a_position_set_otherwise_is_replayed_where_it_was(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    positions = places()
    windows = windows_of(positions)
    windows[4] = replace(windows[4], alpha=windows[4].alpha + np.deg2rad(2.0))
    block = simulate(DEVICE, windows, seed=4)
    folder = write_session(tmp_path / "s", block, positions)
    code, said, twin = diagnosed(folder, capsys)
    assert code == 1 and said["verdict"] == "unexplained" and not twin.effects
    assert {tuple(m["positions"]) for m in said["mismatch"]} == {(4,)}
    (advice,) = said["next"]
    start, _, rest = advice.partition("α was off by ")
    assert start == "Set position 5 again and repeat it: "
    value, _, sigma = rest.removesuffix(" deg there.").split()
    assert abs(float(value) - 2.0) < 4 * float(sigma) < 0.1
    replays = said["twin"]
    assert 0.8 < replays["twin"]["chi2_per_dof"] < 1.2
    assert replays["refitted"]["chi2_per_dof"] > 10.0


@pytest.mark.thorough
def test_windows_that_were_calm_are_calm_in_the_replay(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What an engine shook for a while is shaken then, and then alone."""
    device = replace(DEVICE, effects=(parse("vibration_rectification:x=0.08,y=-0.09"),))
    positions = places(seconds=25.0)
    windows = [
        replace(w, vibration=1.5 if i % 4 == 1 else 0.0)
        for i, w in enumerate(windows_of(positions))
    ]
    folder = write_session(tmp_path / "s", simulate(device, windows, seed=2), positions)
    code, said, _ = diagnosed(folder, capsys)
    assert code == 1
    assert [e["id"] for e in said["effects"]] == ["vibration_rectification"]
    replays = said["twin"]
    assert 0.8 < replays["twin"]["chi2_per_dof"] < 1.2
    assert replays["twin"]["chi2_per_dof"] < replays["refitted"]["chi2_per_dof"]
    calm = [p for i, p in enumerate(replays["positions"]) if i % 4 != 1]
    assert all(p["twin"]["rms_acceleration"] < 0.02 for p in calm)


@pytest.mark.thorough
def test_the_device_file_has_the_device_as_it_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    noise = replace(QUIET, acc=(0.01, 0.02, 0.015), gyr=(1e-3, 1.5e-3, 1.2e-3))
    folder = concealing(tmp_path / "s", "earth_rate", noise=noise)
    code, said, twin = diagnosed(folder, capsys)
    assert (code, said["verdict"]) == (0, "consistent")
    truth = DEVICE.truth
    np.testing.assert_allclose(twin.truth.acc_bias, truth.acc_bias, atol=0.02)
    np.testing.assert_allclose(twin.truth.acc_scale, truth.acc_scale, atol=2e-3)
    np.testing.assert_allclose(twin.truth.gyr_bias, truth.gyr_bias, atol=2e-4)
    np.testing.assert_allclose(twin.noise.acc, noise.acc, rtol=0.03)
    np.testing.assert_allclose(twin.noise.gyr, noise.gyr, rtol=0.03)
    assert twin.sampling.rate_hz == pytest.approx(100.0)
    assert twin.temperature.points[-1][1] - twin.temperature.points[0][1] > 0.5
    assert said["twin"]["simulation"]["chi2_per_dof"] > 100  # nominal: no bias known
    again, plain = (said["twin"][k]["chi2_per_dof"] for k in ("refitted", "twin"))
    assert again == pytest.approx(plain, rel=0.02)


@pytest.mark.thorough
def test_a_session_may_begin_at_any_time_of_the_device(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    device = replace(DEVICE, effects=(parse("bias_step:ay=0.05,at_s=120"),))
    positions = places()
    block = later(recorded(device, positions), 7200.0)
    for p in positions:
        p |= {"start_s": p["start_s"] + 7200.0, "end_s": p["end_s"] + 7200.0}
    _, said, twin = diagnosed(write_session(tmp_path / "s", block, positions), capsys)
    step = twin.one("bias_step")
    assert step is not None and step["at_s"] == pytest.approx(120, abs=6)
    assert said["effects"][0]["parameters"]["at_s"]["value"] > 7200
    assert 0.8 < said["twin"]["twin"]["chi2_per_dof"] < 1.2


@pytest.mark.thorough
def test_the_twin_feels_the_earth_as_its_fixture_is_turned(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Gyroscopes without a compass show where north is; biases go along with that."""
    noise = replace(QUIET, acc=(2e-3,) * 3, gyr=(1e-4,) * 3)
    effects = (parse("earth_rate"), parse("heading_error:psi_deg=60"))
    device = replace(DEVICE, noise=noise, effects=effects)
    angles = [(0, 0), (90, 0), (-90, 0), (180, 0), (0, 90), (0, -90), (45, 45)]
    positions = places([(float(a), float(b)) for a, b in angles], seconds=40.0)
    block = recorded(device, positions)
    _, said, twin = diagnosed(write_session(tmp_path / "s", block, positions), capsys)
    heading = twin.one("heading_error")
    assert heading is not None and heading["psi_deg"] == pytest.approx(60, abs=5)
    np.testing.assert_allclose(twin.truth.gyr_bias, DEVICE.truth.gyr_bias, atol=1e-5)
    assert 0.8 < said["twin"]["twin"]["chi2_per_dof"] < 1.2
    assert said["twin"]["refitted"]["chi2_per_dof"] > 2


def test_what_settles_counts_from_one_instant() -> None:
    """From where it counts changes what the rows are by nothing."""
    effect, shape = catalogue()["settling"], {"tau_s": 5.0}
    on = np.eye(6)
    terms = (Term(effect, 0.05 * on[0], shape), Term(effect, 3e-3 * on[3], shape, 1))
    state = State(np.zeros(6), np.ones(6), np.zeros((1, 2)), np.zeros(3), terms)
    x = Experience.at_rest(np.zeros(9), np.zeros(9), 9.8)
    since = np.arange(9.0) + [[2.0], [0.0]]
    once = from_one_instant(state, since)
    assert [t.origin for t in once.terms] == [1, 1]
    np.testing.assert_allclose(once.output(x, since), state.output(x, since))
    both = effects_of_terms(once.terms, 0.0)
    assert len(both) == 1 and both[0]["gx"] == 3e-3


@pytest.mark.parametrize(
    ("concealed", "triad"),
    [
        ("hum:ax=0.02,gz=0.002,hz=17.3,phase_deg=40", "rms_acceleration"),
        pytest.param(
            "sway:amplitude_deg=0.05,hz=0.4,azimuth_deg=30",
            "rms_angular_rate",
            marks=pytest.mark.thorough,
        ),
    ],
)
@pytest.mark.thorough
def test_of_a_line_the_replay_leaves_little(
    concealed: str, triad: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, said, twin = diagnosed(concealing(tmp_path / "s", concealed), capsys)
    old, new = (said["twin"][run]["lines"][0][triad] for run in ("refitted", "twin"))
    assert new < 0.2 * old
    assert 0.8 < said["twin"]["twin"]["chi2_per_dof"] < 1.2
    assert twin.every(concealed.partition(":")[0])
    assert "Of the line it leaves" in said["says"]


@pytest.mark.parametrize(
    ("missing", "hum", "unit"),
    [("acc", "hum:hz=7.3,gx=0.02", "rad/s"), ("gyr", "hum:hz=7.3,ax=0.2", "m/s^2")],
)
def test_a_line_is_told_of_the_triad_that_there_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str],
    missing: str, hum: str, unit: str,
) -> None:  # fmt: skip
    positions = places(seconds=10.0)[:3]
    block = recorded(replace(DEVICE, effects=(parse(hum),)), positions, 1)
    none = np.full_like(block.acc, np.nan)
    write_session(tmp_path, replace(block, **{missing: none}), positions)
    _, said, _ = diagnosed(tmp_path, capsys)
    told = re.search(r"Of the line it leaves (\S+) of (\S+) (\S+)\.", said["says"])
    assert told is not None and told[3] == unit, said["says"]
    assert 0 <= float(told[1]) < 0.1 * float(told[2])


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("concealed", "figure", "part"),
    [
        pytest.param(
            "gyro_scale:s1=0.01,s3=-0.012",
            "rms_turns_rad",
            0.2,
            marks=pytest.mark.thorough,
        ),
        pytest.param(
            "gyro_cross_coupling:s12=0.02",
            "rms_turns_rad",
            0.6,
            marks=pytest.mark.thorough,
        ),
        pytest.param(
            "lever_arm:x=0.05,z=-0.03",
            "rms_turns_acceleration",
            0.6,
            marks=pytest.mark.thorough,
        ),
        ("time_delay:seconds=0.02", "rms_turns_acceleration", 0.2),
    ],
)
def test_what_shows_in_turns_is_measured_on_the_way(
    concealed: str,
    figure: str,
    part: float,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    _, said, _ = diagnosed(concealing(tmp_path / "s", concealed), capsys)
    runs = said["twin"]
    assert runs["twin"][figure] < part * runs["refitted"][figure]
    # white noise of 0.02 m/s^2 over 0.15 s, and of 0.002 rad/s over some 5 s
    assert runs["twin"]["rms_turns_acceleration"] == pytest.approx(0.005, rel=0.1)
    assert runs["twin"]["rms_turns_rad"] < 1e-3
    assert "instead of" in said["says"]


@pytest.mark.thorough
def test_a_twin_without_what_turns_show_is_as_far_off_as_before(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = concealing(tmp_path / "s", "cross_coupling:k12=0.01")
    _, said, _ = diagnosed(folder, capsys)
    old, new = (said["twin"][run]["rms_turns_rad"] for run in ("refitted", "twin"))
    assert new == pytest.approx(old, rel=0.1)
    assert "Turns come out" not in said["says"]


@pytest.mark.thorough
def test_what_is_random_gives_spread_and_not_the_same_numbers(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The spread of the angles a twin is held at is that of the real one's."""
    folder = concealing(tmp_path / "s", "angle_setting:sigma_deg=0.3", seed=5)
    _, said, twin = diagnosed(folder, capsys)
    setting = twin.one("angle_setting")
    assert setting is not None and 0.15 < setting["sigma_deg"] < 0.6
    assert said["twin"]["random"] == ["angle_setting"]
    assert "compare its spread" in said["says"]
    positions, apart = places(), []
    for seed in range(6):
        block = recorded(twin, positions, seed)
        level = recorded(replace(twin, effects=()), positions, seed)
        for p in positions:
            ours, theirs = (
                b.between(p["start_s"], p["end_s"]).acc.mean(axis=0)
                for b in (block, level)
            )
            apart.append((ours - theirs)[[0, 2]] / 9.81)
    # alpha moves ax by g, in the positions with alpha = 0; beta moves az
    home = np.array(apart).reshape(6, 9, 2)[:, ::3]
    spread = np.rad2deg(np.sqrt(np.mean(home**2)))
    assert spread == pytest.approx(setting["sigma_deg"], rel=0.3)


@pytest.mark.thorough
def test_positions_without_angles_are_replayed_where_they_were(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    angles = [(0, 0), (90, 0), (-90, 0), (180, 0), (0, 90), (0, -90)]
    angles += [(45, 30), (-45, 40), (130, -30), (-120, 50), (60, -60), (20, 70)]
    positions = places([(float(a), float(b)) for a, b in angles])
    device = replace(DEVICE, effects=(parse("cross_coupling:k12=0.01,k23=-0.015"),))
    block = recorded(device, positions)
    unknown = [{k: p[k] for k in ("start_s", "end_s")} for p in positions]
    _, said, _ = diagnosed(write_session(tmp_path / "s", block, unknown), capsys)
    # below 1: which way the Earth turns it is in the gyroscopes' uncertainty
    assert 0.6 < said["twin"]["twin"]["chi2_per_dof"] < 1.2
    assert said["twin"]["refitted"]["chi2_per_dof"] > 2


@pytest.mark.thorough
def test_positions_without_angles_on_a_tilted_base_are_replayed_where_they_were(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    angles = [(0, 0), (90, 0), (-90, 0), (180, 0), (0, 90), (0, -90)]
    angles += [(45, 30), (-45, 40), (130, -30), (-120, 50), (60, -60), (20, 70)]
    positions = places([(float(a), float(b)) for a, b in angles])
    device = replace(DEVICE, effects=(parse("base_tilt:about_x_deg=2,about_z_deg=-1"),))
    block = recorded(device, positions)
    for p in positions[2::3]:
        del p["alpha_deg"], p["beta_deg"]
    _, said, _ = diagnosed(write_session(tmp_path / "s", block, positions), capsys)
    assert 0.8 < said["twin"]["twin"]["chi2_per_dof"] < 1.2
    assert said["twin"]["refitted"]["chi2_per_dof"] > 10


def test_the_circle_closes(
    recalibrated: Recalibrated, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A device, its session, its twin, the twin's session: the same calibration."""
    real = recalibrated.result["parameters"]
    code, said, twin = diagnosed(recalibrated.copy(tmp_path / "real"), capsys)
    assert code == 1 and [e["id"] for e in said["effects"]] == ["base_tilt"]
    positions = places([p.degrees or (0.0, 0.0) for p in FIVE_POSITIONS])
    site = {"latitude_deg": twin.site.latitude_deg, "gravity": twin.gravity}
    block = recorded(twin, positions, seed=2)
    second = write_session(tmp_path / "twin", block, positions, site=site)
    # a chi-squared that is high by chance leaves the numbers less sure than is asked
    assert main(["solve", str(second), "--json"]) in (0, 1)
    result = json.loads(capsys.readouterr().out)
    assert result["verdict"] == "good"
    again = result["parameters"]
    for group in ("acc_bias", "acc_scale", "gyr_bias", "base_tilt"):
        apart = np.subtract(again[group]["value"], real[group]["value"])
        sigma = np.hypot(again[group]["sigma"], real[group]["sigma"])
        assert np.abs(apart / sigma).max() < 4.5, group


@pytest.mark.thorough
def test_temperature_and_warm_up_go_into_the_twin(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    course = ((0.0, 20.0), (120.0, 31.0), (250.0, 24.0))
    climate = Climate(points=course, self_heating_k=0.0)
    folder = concealing(
        tmp_path / "s", "temperature_bias:ax=0.01,gx=1e-3", temperature=climate
    )
    _, said, twin = diagnosed(folder, capsys)
    when = [t for t, _ in climate.points]
    mine = np.interp(when, *np.array(twin.temperature.points).T)
    np.testing.assert_allclose(mine[1:], [31.0, 24.0], atol=1.0)
    assert 0.8 < said["twin"]["twin"]["chi2_per_dof"] < 1.2


@pytest.mark.thorough
def test_the_console_shows_the_replay_and_where_the_files_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = concealing(tmp_path / "s", "base_tilt:about_x_deg=1", count=4)
    file = tmp_path / "twin.toml"
    assert main(["diagnose", str(folder), "--twin", str(file)]) == 1
    out = capsys.readouterr().out
    assert "Replayed by the virtual device" in out and f"written: {file}" in out
    assert (
        tomllib.loads(file.read_text())["site"]["latitude_deg"]
        == (SITE["latitude_deg"])
    )


def test_a_device_file_that_cannot_be_written_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = concealing(tmp_path / "s", "base_tilt:about_x_deg=1", count=4)
    nowhere = tmp_path / "nowhere" / "twin.toml"
    assert main(["diagnose", str(folder), "--twin", str(nowhere)]) == 2
    err = capsys.readouterr().err
    assert str(nowhere) in err and err.count("\n") == 1
