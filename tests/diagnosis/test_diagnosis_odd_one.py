"""One position that is off by itself is found, and what it was set at instead."""

from __future__ import annotations

import json
from pathlib import Path

import ladder
import numpy as np
import pytest
from ladder import LADDER, TACTICAL, Array, Fault, Ride, windows
from ladder_sessions import agrees, diagnosed, hold_first, named

from fieldcal.cli import main
from fieldcal.diagnosis.findings.unknown_mismatch import list_positions
from fieldcal.diagnosis.result import Diagnosis

AMID = ((1, 6), pytest.param(5, len(LADDER), marks=pytest.mark.thorough))
"""Positions, and of how many: amid the session; at its ends a step of the bias would
do as well."""


def off(window: int, axis: int, size: float) -> Fault:
    def add(ridden: Ride, out: Array) -> None:
        out[ridden.held == window, axis] += size

    return add


def tooth(ridden: Ride, out: Array) -> None:
    """A joint's tooth, which in these positions goes as the force to the 2nd power."""
    alpha = np.deg2rad([LADDER[i][0] for i in np.maximum(ridden.held, 0)])
    out[:, 2] += 0.05 * np.sin(8 * alpha + 0.5)


def coupling(ridden: Ride, out: Array) -> None:
    out[:, :3] += ridden.f @ np.array([[0, -0.006, 0], [0.008, 0, 0.007], [0, 0, 0]])


def gyro_coupling(ridden: Ride, out: Array) -> None:
    out[:, 3:] += ridden.w @ np.array([[0, 0, 0], [0.01, 0, 0], [0, 0.006, 0]])


def step(ridden: Ride, out: Array) -> None:
    """Across the force, so that an angle would do as well in the windows."""
    out[ridden.t > windows()[0][1] + 1.0, 0] += 0.05


def misset(monkeypatch: pytest.MonkeyPatch, window: int, *degrees: float) -> None:
    """Turn the device otherwise in one position than the session says."""
    way = [
        tuple(np.add(a, degrees)) if i == window else a for i, a in enumerate(LADDER)
    ]
    monkeypatch.setattr(ladder, "LADDER", tuple(way))


def exchange(monkeypatch: pytest.MonkeyPatch, one: int, two: int) -> None:
    """Turn to two positions in the other order than the session says."""
    way = list(ladder.LADDER)
    way[one], way[two] = way[two], way[one]
    monkeypatch.setattr(ladder, "LADDER", tuple(way))


def worn(monkeypatch: pytest.MonkeyPatch, joint: int, angle: float, off: float) -> None:
    """Turn the device otherwise wherever one angle of a joint is set."""
    way = [list(a) for a in ladder.LADDER]
    for each in way:
        each[joint] += off * (each[joint] == angle)
    monkeypatch.setattr(ladder, "LADDER", tuple(map(tuple, way)))


def places(said: Diagnosis) -> set[tuple[str, tuple[int, ...]]]:
    return {(m.channel, m.positions) for m in said.mismatch if m.kind == "position"}


@pytest.mark.parametrize(("window", "held"), AMID)
def test_one_axis_in_one_position(
    window: int, held: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    axis = window % 3
    hold_first(held, monkeypatch)
    said = diagnosed(tmp_path / "s", TACTICAL, off(window, axis, 0.006), seed=window)
    assert said.verdict == "unexplained" and not named(said)
    assert places(said) == {("a" + "xyz"[axis], (window,))}


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("window", "alpha", "beta"),
    [
        (0, 1.0, 0.0),
        pytest.param(4, 0.0, -1.5, marks=pytest.mark.thorough),
        pytest.param(8, 22.5, 1.0, marks=pytest.mark.thorough),
    ],
)
def test_angles_that_were_set_otherwise_are_said(
    window: int,
    alpha: float,
    beta: float,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    misset(monkeypatch, window, alpha, beta)
    said = diagnosed(tmp_path / "s", TACTICAL, seed=window)
    assert said.verdict == "unexplained" and not named(said)
    assert {p for _, p in places(said)} == {(window,)}
    assert said.after.held_out_rms < 0.2 * said.before.held_out_rms
    assert f"Only position {window + 1} is off, as if" in said.says
    for joint, degrees in (("α", alpha), ("β", beta)):
        if degrees:
            _, _, rest = said.says.partition(f"{joint} had been off by ")
            value, _, sigma = rest.partition(" deg")[0].split()
            assert abs(float(value) - degrees) < 4 * float(sigma) < 0.01
        else:
            assert f"{joint} had been" not in said.says


@pytest.mark.thorough
@pytest.mark.parametrize(("one", "two"), [(2, 6), (0, 7)])
def test_two_positions_in_the_wrong_order_are_said(
    one: int, two: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    exchange(monkeypatch, one, two)
    said = diagnosed(tmp_path / "s", TACTICAL, seed=one)
    assert said.verdict == "unexplained" and not named(said)
    assert {p for _, p in places(said)} == {(one,), (two,)}
    pair = f"ositions {one + 1} and {two + 1}"
    assert f"P{pair} are exchanged: each was held at the angles of" in said.says
    assert "had been off" not in said.says
    assert said.next[0] == (
        f"Exchange the angles of p{pair} in session.toml: each was held at those of the"
        " other."
    )


@pytest.mark.thorough
def test_a_result_is_for_the_order_that_was_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    exchange(monkeypatch, 3, 8)
    diagnosed(tmp_path / "s", TACTICAL, seed=5)
    assert main(["solve", str(tmp_path / "s"), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    (warning,) = (w for w in result["warnings"] if "the angle that was found" in w)
    assert "positions 4 and 9 are exchanged" in warning
    for name in ("acc_bias", "acc_scale", "gyr_bias"):
        found = result["parameters"][name]
        far = np.array(found["value"]) - getattr(TACTICAL, name)
        assert (np.abs(far) < 4 * np.array(found["sigma"])).all()


@pytest.mark.parametrize(
    ("joint", "angle", "off"),
    [(0, 45.0, 0.15), pytest.param(1, 5.0, -0.2, marks=pytest.mark.thorough)],
)
@pytest.mark.thorough
def test_an_angle_that_is_wrong_each_time_is_said(
    joint: int,
    angle: float,
    off: float,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """In all positions that share it, and as one cause; no effect is made of it."""
    alike = tuple(i for i, a in enumerate(LADDER) if a[joint] == angle)
    assert 1 < len(alike) < len(LADDER)
    worn(monkeypatch, joint, angle, off)
    said = diagnosed(tmp_path / "s", TACTICAL, seed=joint)
    assert said.verdict == "unexplained" and not named(said)
    assert {p for _, p in places(said)} == {alike}
    assert said.after.held_out_rms < 0.5 * said.before.held_out_rms
    _, _, rest = said.says.partition(f"{'αβ'[joint]} had been off by ")
    value, _, sigma = rest.partition(" deg")[0].split()
    assert abs(float(value) - off) < 4 * float(sigma) < 0.1
    numbers = list_positions(alike)
    head = f"Set the angle {'αβ'[joint]} of {numbers} again and repeat these"
    assert (
        f"{head} positions: {'αβ'[joint]} was off by {value} ± {sigma} deg"
        in said.next[0]
    )
    main(["solve", str(tmp_path / "s"), "--json"])
    result = json.loads(capsys.readouterr().out)
    assert result["carried"]["causes"]["repeated_angle"] > 0.99
    assert "repeated_angle" not in result.get("not_carried", {}).get("causes", {})
    assert not any("repeated_angle" in w for w in result["warnings"])
    (warning,) = (w for w in result["warnings"] if "the angle that was found" in w)
    size = f"{'αβ'[joint]} was off by {value} ± {sigma} deg in {numbers}:"
    assert f"a wrong angle, as {size}" in warning
    for name in ("acc_bias", "acc_scale", "gyr_bias"):
        found = result["parameters"][name]
        far = np.array(found["value"]) - getattr(TACTICAL, name)
        assert (np.abs(far) < 4 * np.array(found["sigma"])).all()


@pytest.mark.thorough
def test_of_two_worn_angles_both_are_said_and_the_second_is_in_every_sigma(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The second by itself stands out of nothing: rows show it beside the first."""
    worn(monkeypatch, 0, 45.0, 0.03)
    worn(monkeypatch, 1, 5.0, 0.08)
    said = diagnosed(tmp_path / "s", TACTICAL, seed=3)
    assert said.verdict == "unexplained" and not named(said)
    assert "α was off by" in " ".join(said.next)
    assert "β was off by" in " ".join(said.next)
    main(["solve", str(tmp_path / "s"), "--json"])
    result = json.loads(capsys.readouterr().out)
    assert result["carried"]["causes"]["repeated_angle"] > 0.99
    for name in ("acc_bias", "acc_scale", "gyr_bias"):
        found = result["parameters"][name]
        far = np.array(found["value"]) - getattr(TACTICAL, name)
        assert (np.abs(far) < 4 * np.array(found["sigma"])).all()


@pytest.mark.thorough
def test_an_effect_besides_has_its_numbers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    misset(monkeypatch, 3, 0.5, 0.5)
    said = diagnosed(tmp_path / "s", TACTICAL, coupling, seed=3)
    assert said.verdict == "unexplained" and named(said) == ["cross_coupling"]
    agrees(said, "cross_coupling", {"k12": 0.008, "k21": -0.006, "k32": 0.007})
    assert "Only position 4 is off, as if α had been off by 0.49" in said.says


@pytest.mark.thorough
def test_a_step_behind_the_first_position_is_one(tmp_path: Path) -> None:
    """Turns that end where they are said to end tell it from an angle."""
    said = diagnosed(tmp_path / "s", TACTICAL, step, gyro_coupling)
    assert sorted(named(said)) == ["bias_step", "gyro_cross_coupling"]
    agrees(said, "bias_step", {"ax": 0.05})
    agrees(said, "gyro_cross_coupling", {"s12": 0.01, "s23": 0.006})


@pytest.mark.thorough
def test_a_size_that_no_device_has_is_no_cause(tmp_path: Path) -> None:
    said = diagnosed(tmp_path / "s", TACTICAL, tooth)
    assert said.verdict == "unexplained" and not named(said)
    assert {m.channel for m in said.mismatch} == {"az"}
