"""When joints were turned, from which side, and about which axes."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.frames import direction_cosines
from fieldcal.physics.joint_turns import JointTurns

P = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
"""A mounting: procedure axes by device axes."""


def test_sides_are_those_of_the_angles_that_changed() -> None:
    alpha = np.array([0.0, 0.7, 0.7, np.nan, 0.2, -0.2])
    beta = np.array([0.1, 0.1, -0.1, 0.0, 0.1, 0.1 + 1e-9])
    at = np.array([-np.inf, 10.0, 20.0, 30.0, 40.0, 50.0])
    found = JointTurns.of(at, np.column_stack([alpha, beta, 0 * beta]))
    # nobody knows from where the fifth position was come to, nor the fourth itself
    assert found.at.tolist() == [10.0, 20.0, 50.0]
    assert found.side.tolist() == [[1.0, 0.0], [0.0, -1.0], [-1.0, 0.0]]
    assert found.angles[:, 0].tolist() == [0.7, 0.7, -0.2]


def test_an_instant_that_nobody_knows_is_left_out() -> None:
    angles = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    found = JointTurns.of(np.array([0.0, np.inf, 9.0]), angles)
    assert found.at.tolist() == [9.0] and found.side.tolist() == [[-1.0, 0.0]]
    assert not len(JointTurns.none().at)


@pytest.mark.parametrize("seed", range(4))
def test_axes_are_those_about_which_a_joint_turns_the_device(seed: int) -> None:
    """By differences of the direction cosines: v' = v - d x (e x v)."""
    rng = np.random.default_rng(seed)
    angles = np.vstack([np.zeros(3), rng.uniform(-3, 3, 3), rng.uniform(-3, 3, 3)])
    turns = JointTurns.of(np.array([0.0, 10.0, 20.0]), angles)
    t = np.array([3.0, 12.0, 18.9, 19.1, 33.0])
    axes = turns.axes(t, 1.0, P)
    v, d = rng.normal(size=3), 1e-6
    for k, row in enumerate([1, 1, 1, 2, 2]):
        for joint in (0, 1):
            step = d * np.eye(3)[joint]
            up, down = (
                P.T @ direction_cosines(*(angles[row] + s * step)) @ v for s in (1, -1)
            )
            held = P.T @ direction_cosines(*angles[row]) @ v
            moved = -np.cross(axes[k, :, joint], held)
            np.testing.assert_allclose((up - down) / (2 * d), moved, atol=1e-8)
