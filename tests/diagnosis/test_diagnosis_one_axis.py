"""Effects on one axis alone, with which others nearly agree in nine positions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from ladder import LADDER, TACTICAL, Array, Fault, Ride
from ladder_sessions import agrees, diagnosed, hold_first, named

SEEDS = (1, pytest.param(2, marks=pytest.mark.thorough))


def jump(at_s: float, **sizes: float) -> Fault:
    def add(ridden: Ride, out: Array) -> None:
        for channel, size in sizes.items():
            out[
                ridden.t >= at_s, ("ax", "ay", "az", "gx", "gy", "gz").index(channel)
            ] += size

    return add


def line(channel: int, size: float, hz: float) -> Fault:
    def add(ridden: Ride, out: Array) -> None:
        out[:, channel] += size * np.sin(2 * np.pi * hz * ridden.t + 0.4)

    return add


def coupled(row: int, column: int, size: float) -> Fault:
    """Outputs of one axis, 0 to 5, that take up a force along another."""

    def add(ridden: Ride, out: Array) -> None:
        out[:, row] += size * ridden.f[:, column]

    return add


@pytest.mark.parametrize(
    ("held", "seed", "at_s", "sizes"),
    [
        (6, 2, 100.0, {"ay": 0.0135}),
        *(
            pytest.param(len(LADDER), *case, marks=pytest.mark.thorough)
            for case in (
                (1, 145.4, {"ay": 0.03, "ax": -0.02}),
                (2, 150.0, {"ay": 0.0135}),
                (3, 96.5, {"gz": 0.001}),
                (6, 139.3, {"gz": 0.0005, "ax": 0.002}),
            )
        ),
    ],
)
def test_a_jump_amid_a_window_is_no_bump_and_has_its_size(
    held: int,
    seed: int,
    at_s: float,
    sizes: dict[str, float],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    hold_first(held, monkeypatch)
    said = diagnosed(tmp_path / "s", TACTICAL, jump(at_s, **sizes), seed=seed)
    assert named(said) == ["bias_step"]
    agrees(said, "bias_step", {**sizes, "at_s": at_s})


@pytest.mark.thorough
@pytest.mark.parametrize("seed", SEEDS)
def test_a_slow_line_does_not_pass_for_a_lever_arm_in_turns(
    seed: int, tmp_path: Path
) -> None:
    said = diagnosed(tmp_path / "s", TACTICAL, line(0, 0.003, 0.3), seed=seed)
    assert named(said) == ["hum"]
    agrees(said, "hum", {"ax": 0.003, "hz": 0.3})


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("concealed", "fault", "likewise"),
    [
        ("cross_coupling", coupled(0, 1, 9e-4), "quadratic"),
        pytest.param(
            "g_sensitivity",
            coupled(4, 1, 1e-5),
            "g2_sensitivity",
            marks=pytest.mark.thorough,
        ),
    ],
)
def test_what_the_positions_cannot_tell_apart_is_said(
    concealed: str, fault: Fault, likewise: str, tmp_path: Path
) -> None:
    """As long as one angle turns, f_y is a function of f_x, and hardly changes.

    Only for sizes that sensors have of both: those are known beforehand.
    """
    said = diagnosed(tmp_path / "s", TACTICAL, fault)
    (effect,) = said.effects
    assert {concealed, likewise} <= {effect.id, *effect.aliases}


@pytest.mark.thorough
def test_a_force_along_the_axis_alone_is_no_alias(tmp_path: Path) -> None:
    said = diagnosed(tmp_path / "s", TACTICAL, coupled(1, 0, 4e-3))
    (effect,) = said.effects
    assert effect.id == "cross_coupling" and "quadratic" not in effect.aliases
    agrees(said, "cross_coupling", {"k21": 4e-3})
