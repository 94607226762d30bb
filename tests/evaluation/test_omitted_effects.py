"""What `solve` puts right, and what it says that it does not carry."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from observed import observe, outputs
from session_folders import CALM, FACES, SITE, WIDE, places, recorded, write_session

from fieldcal.calibration.names import TILTS
from fieldcal.cli import main
from fieldcal.core.positions import SIX_FACES
from fieldcal.evaluation import angle_setting, omitted_effects
from fieldcal.model.posterior.probabilities import ProbableCause
from fieldcal.sim_device.profile import NoiseFigures, Profile
from fieldcal.sim_device.vocabulary import checked_effect
from fieldcal.solve import solve

UNEXAMINED = {"model": {"effects": ["nonsense"]}}
"""Of a session whose samples are not examined the means alone are solved."""


def device(*effects: Any) -> Profile:
    """A device with nothing but some effects."""
    return replace(CALM, effects=(*CALM.effects, *effects))


def solved(
    profile: Profile, folder: Path, capsys: pytest.CaptureFixture[str], *options: str,
    angles: Sequence[tuple[float, float]] = WIDE, **tables: Any,
) -> tuple[int, dict[str, Any]]:  # fmt: skip
    """Exit code and result.json of a session in some positions."""
    held = places(angles)
    write_session(folder, recorded(profile, held), held, **tables)
    code = main(["solve", str(folder), "--json", *options])
    out: dict[str, Any] = json.loads(capsys.readouterr().out)
    return code, out


def off(said: dict[str, Any], profile: Profile) -> np.ndarray[Any, np.dtype[Any]]:
    """How far biases and scale factors are from the truth, in stated sigmas."""
    found = said["parameters"]
    return np.concatenate(
        [
            (np.array(found[name]["value"]) - getattr(profile.truth, name))
            / np.array(found[name]["sigma"])
            for name in ("acc_bias", "acc_scale")
        ]
    )


@pytest.mark.parametrize(
    "tables", [UNEXAMINED, pytest.param({}, marks=pytest.mark.thorough)]
)
def test_wrongly_decoded_bytes_are_put_right(
    tables: dict[str, Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fault = checked_effect("decode_fault", {"channel": "ay", "kind": "low_byte_signed"})
    profile = device(fault)
    code, said = solved(profile, tmp_path / "s", capsys, **tables)
    assert code == 0 and said["verdict"] == "good"
    assert np.abs(off(said, profile)).max() < 4.5
    assert any("bytes were decoded wrongly" in w for w in said["warnings"])


@pytest.mark.parametrize(
    "tau",
    [{"acc": 1.2, "gyr": 1.2}, pytest.param({"gyr": 0.4}, marks=pytest.mark.thorough)],
)
def test_smoothed_outputs_are_calibrated_as_the_device_sends_them(
    tau: dict[str, float], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Windows begin at the end of a turn, when smoothed outputs are still on it."""
    profile = device(checked_effect("smoothing", tau))
    code, said = solved(profile, tmp_path / "s", capsys, model=UNEXAMINED["model"])
    assert code == 0 and said["verdict"] == "good"
    assert np.abs(off(said, profile)).max() < 4.5
    (undone,) = (w for w in said["warnings"] if "a program smoothed the outputs" in w)
    seconds = [float(part.split(" ±")[0]) for part in re.findall(r"[\d.]+ ±", undone)]
    assert seconds == pytest.approx(list(tau.values()), rel=0.1)
    assert ("accelerometers" in undone) == ("acc" in tau) and "gyroscopes" in undone


@pytest.mark.thorough
def test_bytes_are_put_right_for_a_method_that_is_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fault = checked_effect("decode_fault", {"channel": "ay", "kind": "low_byte_signed"})
    profile = device(fault)
    said = solved(profile, tmp_path / "s", capsys)[1]
    as_printed = solved(profile, tmp_path / "p", capsys, "--method", "joint")[1]
    assert as_printed["parameters"]["acc_scale"] == said["parameters"]["acc_scale"]


@pytest.mark.parametrize(
    ("size", "ignored", "angles"),
    [
        (1e-4, 5.0, WIDE[:7]),
        pytest.param(-3e-5, 1.0, WIDE, marks=pytest.mark.thorough),
    ],
)
def test_a_drift_is_in_the_result(
    size: float,
    ignored: float,
    angles: list[tuple[float, float]],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The bias is that at the end, and what the drift moves is said.

    Angles that are set to 0.05° show a drift of 8e-3 m/s² in 5 minutes badly: it is as
    large as was found, and no smaller because it is less certain.
    """
    profile = device(checked_effect("bias_drift", {"ax": size}))
    code, said = solved(profile, tmp_path / "s", capsys, angles=angles)
    assert code == 0 and said["verdict"] == "good"
    assert "not_carried" not in said
    there = said["carried"]
    assert there["causes"]["bias_drift"] > 0.8
    truth = profile.truth
    ended = truth.acc_bias[0] + size * there["as_of"]["since_start_s"]
    at_end = replace(truth, acc_bias=(ended, *truth.acc_bias[1:]))
    assert (np.abs(off(said, replace(profile, truth=at_end))) < 2.5).all()
    assert np.abs(off(said, profile)).max() > ignored
    worst = max(there["moved_sigmas"], key=lambda n: abs(there["moved_sigmas"][n]))
    assert worst == "acc_bias.x"
    assert np.sign(there["moved_sigmas"][worst]) == np.sign(size)
    assert any(
        "takes it into account" in w and "end of the recording" in w
        for w in said["warnings"]
    )


@pytest.mark.thorough
def test_flicker_that_moves_the_instant_of_the_biases_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It is noise, and no effect that is listed: the reader must see why."""
    flickers = NoiseFigures(acc_instability=(3e-3,) * 3, gyr_instability=(2e-5,) * 3)
    bent = checked_effect("quadratic", {"x": 3e-4})
    profile = replace(CALM, noise=flickers, effects=(*CALM.effects, bent))
    held = places(WIDE)
    folder = write_session(tmp_path / "s", recorded(profile, held, 6), held)
    main(["solve", str(folder), "--json"])
    said = json.loads(capsys.readouterr().out)
    assert "flicker" not in said["carried"]["causes"]
    assert said["carried"]["as_of"]["because"]["flicker"] > 0.9
    assert any(
        "end of the recording, 275 s after its start, as flicker noise of the biases"
        " (probability 1.00) may change them" in each
        for each in said["warnings"]
    )


COURSES = {
    "bias_drift": {"ax": 4e-6, "az": -2.5e-5, "gy": 2e-7},
    "warm_up": {"ax": 8e-3, "ay": -5e-3, "gx": 3e-4, "gz": -2e-4, "tau_s": 200.0},
}


def course(name: str, t: float) -> np.ndarray[Any, np.dtype[Any]]:
    """What a course has come to, of the six outputs."""
    own = COURSES[name]
    six = np.array([own.get(f"{s}{i}", 0.0) for s in "ag" for i in "xyz"])
    grown: float = t if name == "bias_drift" else float(np.exp(-t / own["tau_s"]))
    return six * grown


@pytest.mark.thorough
def test_intervals_hold_with_a_course_in_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Coverage over seeds, of biases at the end and of scale factors."""
    held = places(WIDE)
    pulls: list[float] = []
    for seed, name in enumerate([*COURSES] * 3):
        profile = device(checked_effect(name, COURSES[name]))
        folder = tmp_path / str(seed)
        write_session(folder, recorded(profile, held, seed), held)
        main(["solve", str(folder), "--json", "--angles", "0.0001"])
        said = json.loads(capsys.readouterr().out)
        end = course(name, said["carried"]["as_of"]["since_start_s"])
        for group in ("acc_bias", "acc_scale", "gyr_bias"):
            right = np.array(getattr(profile.truth, group))
            if group.endswith("bias"):
                right = right + end[:3] if group == "acc_bias" else right + end[3:]
            found = said["parameters"][group]
            off = (np.array(found["value"]) - right) / np.array(found["sigma"])
            pulls += off.tolist()
    assert len(pulls) == 54
    assert 0.75 < np.sqrt(np.mean(np.square(pulls))) < 1.3
    assert np.mean(np.abs(pulls) < 1.96) > 0.85


@pytest.mark.thorough
def test_nothing_is_said_of_a_device_that_has_nothing_more(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, said = solved(CALM, tmp_path / "s", capsys)
    assert code == 0
    assert "not_carried" not in said
    # what is all but out of the question moves nothing by a tenth of a sigma
    moved = said.get("carried", {"moved_sigmas": {}})["moved_sigmas"].values()
    assert all(abs(m) < 0.1 for m in moved)


@pytest.mark.thorough
def test_cross_coupling_that_was_asked_for_is_carried(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    profile = device(checked_effect("cross_coupling", {"k12": 5e-3, "k31": -4e-3}))
    code, said = solved(profile, tmp_path / "s", capsys, "--cross")
    assert code == 0
    assert "not_carried" not in said
    # what is all but out of the question moves nothing
    carried = said.get("carried", {"causes": {}, "moved_sigmas": {}})
    assert not carried["causes"]
    assert all(abs(m) < 1e-3 for m in carried["moved_sigmas"].values())
    without = solved(profile, tmp_path / "w", capsys)[1]
    assert without["carried"]["causes"]["cross_coupling"] > 0.9
    assert "as_of" not in without["carried"]
    assert (np.abs(off(without, profile)) < 4).all()
    assert any("takes it into account" in w for w in without["warnings"])


@pytest.mark.thorough
@pytest.mark.parametrize("unit", ["deg/s"])
def test_rates_in_another_unit_are_never_solved_as_good(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], unit: str
) -> None:
    """At rest nothing shows it: the turns between positions do."""
    profile = device(checked_effect("mounting", {"unit": unit}))
    code, said = solved(profile, tmp_path / "s", capsys)
    assert (code, said["verdict"]) == (1, "bad")
    assert f"wrong about the mounting (unit = {unit})" in said["warnings"][0]
    # the accelerometers are as they were
    assert (np.abs(off(said, profile)) < 4).all()
    assert main(["diagnose", str(tmp_path / "s"), "--json"]) == 1
    found = json.loads(capsys.readouterr().out)["effects"]
    assert [e["id"] for e in found] == ["mounting"]
    assert found[0]["parameters"]["unit"]["value"] == unit


LADDER = [
    *[(0.0, 0.0), (22.5, 0.0), (45.0, 0.0), (45.0, 5.0), (22.5, 5.0), (0.0, 5.0)],
    *[(-22.5, 2.5), (-45.0, 5.0), (-45.0, 0.0)],
]


@pytest.mark.thorough
@pytest.mark.parametrize("missed", [0.2, pytest.param(0.6, marks=pytest.mark.thorough)])
def test_a_rest_of_the_ladder_that_is_off_is_never_a_good_result_that_is_wrong(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], missed: float
) -> None:
    """By the same each time: only the turns show it, and the scale factor of z has it.

    It is an angle that is set badly, or a gauge that is stretched; each is said.
    """
    there = places([(a, b + missed * (b == 5)) for a, b in LADDER])
    write_session(tmp_path, recorded(CALM, there), places(LADDER))
    main(["solve", str(tmp_path), "--json"])
    out: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert "angle" in out["warnings"][0]
    if out["verdict"] == "good":
        assert (np.abs(off(out, CALM)) < 4).all()
        assert out["angle_sigma_deg"] > 0.05 or out["carried"]["causes"]
    else:
        assert out["not_carried"]["moved_sigmas"]["acc_scale.z"] < -5


BY_HAND = [(181.3, 0.8), (88.9, -1.6), (1.1, 91.4), (-92.0, 0.7)]
"""Faces on which the device is laid: about these angles, and nobody knows which."""


@pytest.mark.thorough
@pytest.mark.parametrize(("size", "other"), [(44.0, False), (231.0, True)])
def test_angles_that_nobody_sets_so_are_those_of_other_positions(
    size: float,
    other: bool,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Their size was refused as an option that nobody had given."""
    monkeypatch.setattr(angle_setting, "shown_angle_setting", lambda _: size)
    there = np.random.default_rng(5).uniform(-90.0, 90.0, (6, 2)).tolist()
    write_session(tmp_path, recorded(CALM, places(there)), places(FACES), site=SITE)
    assert main(["solve", str(tmp_path), "--json"]) == 1
    out: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert out["verdict"] == "bad" or not other
    assert (angle_setting.OTHER_ANGLES in out["warnings"]) == other


@pytest.mark.thorough
def test_turns_bear_witness_to_angles_that_six_faces_make_up_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Biases take what the angles of six faces are off by; turns are off by it too."""
    missed = np.random.default_rng(0).normal(0.0, 0.06, (6, 2))
    there = (np.array(FACES) + missed).tolist()
    site = {**SITE, "angle_setting_deg": 0.01}
    write_session(tmp_path, recorded(CALM, places(there)), places(FACES), site=site)
    main(["solve", str(tmp_path), "--json"])
    out: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert "angles are set to ±" in " ".join(out["warnings"])
    assert 0.03 < out["angle_sigma_deg"] < 0.1 and out["angles_stated_deg"] == 0.01
    assert (np.abs(off(out, CALM)) < 4).all()


@pytest.mark.thorough
def test_faces_laid_by_hand_bear_witness_to_angles_set_badly(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each is off by another amount, 15 times what is said; the ± is for that."""
    missed = np.random.default_rng(5).normal(0.0, 0.15, (len(LADDER), 2))
    there = [*(np.array(LADDER) + missed).tolist(), *BY_HAND]
    said = places([*LADDER, *BY_HAND])
    for row in said[len(LADDER) :]:
        del row["alpha_deg"], row["beta_deg"]
    site = {**SITE, "angle_setting_deg": 0.01}
    write_session(tmp_path, recorded(CALM, places(there)), said, site=site)
    main(["solve", str(tmp_path), "--json"])
    out: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert out["verdict"] == "good"
    assert 0.1 < out["angle_sigma_deg"] < 0.25
    assert (np.abs(off(out, CALM)) < 4).all()
    main(["diagnose", str(tmp_path), "--json"])
    (found,) = json.loads(capsys.readouterr().out)["effects"]
    assert found["id"] == "angle_setting"
    assert abs(found["parameters"]["sigma_deg"]["value"] - 0.15) < 0.05


@pytest.mark.thorough
def test_gravity_that_nobody_said_is_in_the_uncertainty_and_no_finding(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A scale factor of all axes alike, which gravity elsewhere would be as well."""
    profile = replace(CALM, truth=replace(CALM.truth, acc_scale=(1.0016,) * 3))
    held = places(FACES, 12.0)
    free = [{k: v for k, v in p.items() if "deg" not in k} for p in held]
    block, verdicts = recorded(profile, held), {}
    for name, site in (("said", SITE), ("unsaid", {})):
        write_session(tmp_path / name, block, free, site=site)
        main(["solve", str(tmp_path / name), "--json"])
        said = json.loads(capsys.readouterr().out)
        main(["diagnose", str(tmp_path / name), "--json"])
        verdicts[name] = json.loads(capsys.readouterr().out)["verdict"]
        sigma = np.array(said["parameters"]["acc_scale"]["sigma"])
        moved = said.get("not_carried", {}).get("moved_sigmas", {})
        if name == "said":
            assert (sigma < 1e-4).all() and max(map(abs, moved.values())) > 2
        else:
            # gravity of any latitude, and no latitude was said
            assert (sigma > 1.4e-3).all() and (sigma < 1.8e-3).all() and not moved
            truth = np.array(profile.truth.acc_scale)
            found = np.array(said["parameters"]["acc_scale"]["value"])
            assert (np.abs(found - truth) < 2 * sigma).all()
    assert verdicts == {"said": "ambiguous", "unsaid": "consistent"}


def test_a_tilt_that_a_result_has_some_of_beside_the_other_is_carried() -> None:
    seen = observe(SIX_FACES, outputs(SIX_FACES, base_deg=(0.6, -0.4)))
    both = solve(seen, beside_tilt_sigma_deg=0.05)
    only = solve(seen, tilt="base_tilt", beside_tilt_sigma_deg=0.05)
    for name in TILTS:
        shown = ProbableCause(name, (), 0.99, ())
        assert omitted_effects._is_included(both, shown)
        assert omitted_effects._is_included(only, shown) == (name == "base_tilt")


@pytest.mark.thorough
def test_offsets_without_a_cause_may_be_angles_by_which_turns_are_off(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of one output in one position: nothing there tells it from an angle."""
    held, odd, size = places(WIDE), 6, 0.02
    block = recorded(CALM, held)
    inside = (block.t >= held[odd]["start_s"]) & (block.t <= held[odd]["end_s"])
    acc = block.acc + np.outer(inside, [0.0, 0.0, size])
    found = {}
    for name, six in (("as it was", block.acc), ("off", acc)):
        site = {**SITE, "angle_setting_deg": 0.003}
        write_session(tmp_path / name, replace(block, acc=six), held, site=site)
        main(["solve", str(tmp_path / name), "--json"])
        found[name] = json.loads(capsys.readouterr().out)
    assert found["as it was"]["angle_sigma_deg"] == 0.003
    out = found["off"]
    as_angle = np.rad2deg(size / 9.81) / np.sqrt(len(WIDE))
    assert out["angles_stated_deg"] == 0.003
    assert 0.8 < out["angle_sigma_deg"] / as_angle < 1.2
    assert any("no reason that is known" in w for w in out["warnings"])
    before, after = (found[n]["parameters"]["gyr_scale"] for n in found)
    assert (np.array(after["sigma"]) > 1.2 * np.array(before["sigma"])).all()
    assert (np.abs(off(out, CALM)) < 4).all()


TURNED = device(checked_effect("cross_coupling", {"k12": 0.03, "k21": -0.03}))
"""A device that is turned by 1.7 degrees about z in its mount."""

OF_A_RUN: dict[str, Any] = {
    "run": {"procedure": "positions"}, "site": {**SITE, "level_deg": 0.01},
}  # fmt: skip


def test_cross_coupling_that_the_result_lacks_is_no_go(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    history = "--history", str(tmp_path / "history.db")
    code, said = solved(TURNED, tmp_path / "s", capsys, *history, **OF_A_RUN)
    left = said["coupling_left_out"]
    assert {left["axis"], left["of"]} == {"x", "y"}
    assert abs(left["value"]) == pytest.approx(0.03, abs=5 * left["sigma"] + 1e-4)
    checks = {c["name"]: c for c in said["decision"]["checks"]}
    assert code == 1 and checks["cross-coupling"]["ok"] is False
    assert "--cross" in checks["cross-coupling"]["says"]


@pytest.mark.thorough
def test_cross_coupling_that_the_result_has_is_no_check(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    history = "--history", str(tmp_path / "history.db")
    _, whole = solved(TURNED, tmp_path, capsys, "--cross", *history, **OF_A_RUN)
    names = [c["name"] for c in whole["decision"]["checks"]]
    assert "coupling_left_out" not in whole and "cross-coupling" not in names
    assert np.abs(off(whole, TURNED)).max() < 4.5
