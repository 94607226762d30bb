"""Positions told apart by gravity, on a base and in a mounting that nobody stated."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from engine_bench import ABOUT

from fieldcal.core.frames import direction_cosines
from fieldcal.core.positions import FIVE_POSITIONS, Position
from fieldcal.core.samples import Array, Block
from fieldcal.planning.steps import Hold
from fieldcal.run.position_check import AcceptedPosition
from fieldcal.run.wait_reason import WaitState
from fieldcal.run.waiting import PositionWait
from fieldcal.session import description_file


def test_the_next_position_too_early_is_told_from_the_one_asked_for() -> None:
    """Every pair of the five, on bases tilted by up to a degree and a half."""
    rng = np.random.default_rng(6)
    for _ in range(2):
        tilt = direction_cosines(*np.deg2rad(rng.uniform(-1.5, 1.5, 2)))
        f = {i: _force(p, tilt) for i, p in enumerate(FIVE_POSITIONS)}
        for wanted, there in itertools.permutations(range(5), 2):
            known = (
                AcceptedPosition(FIVE_POSITIONS[wanted - 1], f[wanted - 1])
                if wanted
                else None
            )
            waiting = PositionWait(
                Hold(wanted, FIVE_POSITIONS[wanted], 10.0), FIVE_ABOUT, known
            )
            waiting.add(_resting(f[there]), 4.0)
            assert not waiting.arrived, (wanted, there)
            waiting = PositionWait(
                Hold(wanted, FIVE_POSITIONS[wanted], 10.0), FIVE_ABOUT, known
            )
            waiting.add(_resting(f[wanted]), 4.0)
            assert waiting.arrived, (wanted, waiting.problem)


FIVE_ABOUT = description_file.parse_description(
    {
        "site": {"gravity": 9.81},
        "position": [
            dict(zip(("alpha_deg", "beta_deg"), p.degrees or (), strict=False))
            for p in FIVE_POSITIONS
        ],
    }
)


def _force(position: Position, tilt: Array) -> Array:
    f: Array = (
        direction_cosines(position.alpha or 0.0, position.beta or 0.0)
        @ tilt
        @ [0, -9.81, 0]
    )
    return f


def _resting(f: Array) -> Block:
    t = np.arange(400) / 100
    noise = np.random.default_rng(1).standard_normal((400, 6))
    return Block.of(t, f + 0.005 * noise[:, :3], 0.001 * noise[:, 3:])


def test_nothing_is_known_of_a_time_without_samples() -> None:
    waiting = PositionWait(Hold(0, FIVE_POSITIONS[0], 10.0), FIVE_ABOUT, None)
    block = _resting(np.array([0.0, -9.81, 0.0]))
    waiting.add(block[:150], 1.5)
    assert waiting.seconds > 1.0
    waiting.add(block[300:], 3.0)
    assert waiting.seconds < 1.5 and not waiting.arrived


@pytest.mark.parametrize(
    ("up", "axes"), [("+z", "+x,-z,+y"), ("-z", "+x,+z,-y"), ("+y", "+x,-y,-z")]
)
def test_a_unit_on_another_face_is_recognised(up: str, axes: str) -> None:
    """Lying flat with z up is a mounting, and not -89.3° in β."""
    f = np.zeros(3)
    f["xyz".index(up[1])] = 9.7 if up[0] == "+" else -9.7
    waiting = PositionWait(Hold(0, FIVE_POSITIONS[0], 10.0), ABOUT, None)
    rng = np.random.default_rng(0)
    for start in np.arange(0.0, 8.0, 0.1):
        t = start + np.arange(10) / 100
        acc = f + [0.05, 0.02, -0.03] + 0.01 * rng.standard_normal((10, 3))
        waiting.add(Block.of(t, acc, 1e-3 * rng.standard_normal((10, 3))), t[0])
    assert waiting.problem.startswith(f"{up} of the device is up")
    assert f"--mounting={axes}" in waiting.problem
    assert waiting.reason.state is WaitState.MISPLACED


def test_a_turn_that_was_not_made_is_no_mounting() -> None:
    waiting = PositionWait(Hold(0, FIVE_POSITIONS[3], 10.0), ABOUT, None)
    rng = np.random.default_rng(0)
    for start in np.arange(0.0, 8.0, 0.1):
        t = start + np.arange(10) / 100
        acc = [0.0, -9.81, 0.0] + 0.01 * rng.standard_normal((10, 3))
        waiting.add(Block.of(t, acc, 1e-3 * rng.standard_normal((10, 3))), t[0])
    assert waiting.problem and "mounting" not in waiting.problem
