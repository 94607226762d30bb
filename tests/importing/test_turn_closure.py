"""Turns by a hand that jerks: the rests at both ends tell the scale of the rates."""

import numpy as np
import pytest
from laid_about import G, turned

from fieldcal.core.samples import Array
from fieldcal.importing.gravity_size import Gravity
from fieldcal.importing.rate_size import rate_in
from fieldcal.importing.turn_closure import closing_scale

RATE = 100.0
KNOWN = Gravity(G, np.zeros(3), True)


def jerked(seed: int, force: float) -> Array:
    """Rows t, a, w with a hand's own forces while it turns, m/s^2."""
    rows = turned(seed, RATE)
    rng = np.random.default_rng(seed)
    rows[:, 4:] -= np.median(rows[:, 4:], axis=0)
    moves = np.linalg.norm(rows[:, 4:], axis=1) > 0.05
    slow = np.repeat(rng.normal(0, force, (len(rows) // 25 + 1, 3)), 25, axis=0)
    rows[moves, 1:4] += slow[: len(rows)][moves]
    return rows


@pytest.mark.parametrize("unit", [1.0, 180 / np.pi, 939.65])
@pytest.mark.parametrize("force", [0.0, 3.0])
def test_the_scale_of_rates_is_found_however_the_hand_jerks(
    unit: float, force: float
) -> None:
    rows = jerked(3, force)
    found = rate_in(rows[:, 0], rows[:, 1:4], rows[:, 4:] * unit, KNOWN)
    assert found == pytest.approx(unit, rel=0.03)


def test_the_rests_alone_give_it() -> None:
    rows = jerked(4, 15.0)
    found = closing_scale(rows[:, 0], rows[:, 1:4] / G, rows[:, 4:], 1.3)
    assert found == pytest.approx(1.0, rel=0.03)


def test_rates_of_another_device_close_at_no_scale() -> None:
    rows, other = jerked(5, 6.0), jerked(5, 6.0)
    away = np.roll(other[:, 4:], 1, axis=1)
    assert closing_scale(rows[:, 0], rows[:, 1:4] / G, away, 1.0) is None
    assert closing_scale(rows[:, 0], rows[:, 1:4] / G, -other[:, 4:], 1.0) is None
