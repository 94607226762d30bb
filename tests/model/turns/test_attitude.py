"""Attitudes carried along a turn, against the joints that made it."""

import numpy as np
import pytest

from fieldcal.core.frames import direction_cosines
from fieldcal.core.samples import Array
from fieldcal.model.turns.rotation import attitudes_from_rotations, small_turns

SECONDS = 4.0
ALPHA, BETA = np.deg2rad([120.0, -75.0])


def both_joints(t: Array) -> Array:
    """Rates (n, 3) of a device whose two joints turn at once, from rest to rest.

    Alpha about z, then beta about the turned x: (b', a' sin b, a' cos b).
    """
    s = t / SECONDS
    part, speed = s**3 * (10 - 15 * s + 6 * s**2), 30 * s**2 * (1 - s) ** 2 / SECONDS
    late = part**2  # so that the axis of the turn changes
    b, da, db = BETA * late, ALPHA * speed, BETA * 2 * part * speed
    return np.column_stack([db, da * np.sin(b), da * np.cos(b)])


@pytest.mark.parametrize(
    ("rate_hz", "each", "within"), [(200, 4, 1e-7), (50, 1, 4e-6), (25, 1, 4e-5)]
)
def test_two_joints_at_once_come_out_where_they_end(
    rate_hz: int, each: int, within: float
) -> None:
    t = np.arange(round(SECONDS * rate_hz) + 1) / rate_hz
    edge = np.arange(0, len(t), each)
    reached = attitudes_from_rotations(small_turns(t, both_joints(t), edge))[-1]
    apart = reached @ direction_cosines(ALPHA, BETA).T
    assert np.linalg.norm(apart - np.eye(3)) < within
