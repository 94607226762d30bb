"""Whether a hand holds a device, by a force that wanders by an angle that is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_sessions import LADDER, SD, ladder, rows_of

from fieldcal.model.rows import hand_detection
from fieldcal.model.rows.averages import Rows
from fieldcal.model.rows.hand_detection import tremor_rms

EVERY = tuple(range(len(LADDER)))


def held(angle: float, free: tuple[int, ...] = EVERY, rows: int = 12) -> Rows:
    """Rows whose force is turned by so many rad about either axis across it."""
    x, rng = ladder(rows, free), np.random.default_rng(2)
    off = angle * np.cross(x.f, rng.standard_normal((len(x), 3)))
    y = np.hstack([x.f + off, x.w]) + SD * rng.standard_normal((len(x), 6))
    return rows_of(x, y)


def force_wander_angle(rows: Rows) -> float:
    """Of rows whose gyroscopes show a hand in no window."""
    return hand_detection.force_wander_angle(rows, False)


@pytest.mark.parametrize("angle", [2e-3, 1e-2])
def test_the_angle_is_measured(angle: float) -> None:
    assert force_wander_angle(held(angle)) == pytest.approx(angle, rel=0.1)


def test_on_a_table_there_is_none() -> None:
    assert force_wander_angle(held(0.0)) == 0.0
    assert force_wander_angle(held(5e-6)) == 0.0, "within the noise"


def test_it_is_sought_where_orientations_are_not_known() -> None:
    assert force_wander_angle(held(1e-2, ())) == 0.0
    assert force_wander_angle(held(1e-2, (0, 1, 2))) == 0.0, "of so few nobody can tell"
    assert force_wander_angle(held(1e-2, (0, 1, 2, 3))) > 8e-3
    assert force_wander_angle(held(1e-2, rows=1)) == 0.0


def test_what_scatters_along_the_force_as_well_is_no_hand() -> None:
    one = held(0.0)
    rng = np.random.default_rng(3)
    y = one.y.copy()
    y[:, :3] += 1e-2 * rng.standard_normal((len(y), 3))
    assert force_wander_angle(replace(one, y=y)) == 0.0


@pytest.mark.parametrize("angle", [0.0, 2e-3])
def test_a_hand_in_some_windows_pushes_as_well(angle: float) -> None:
    """Along the force as well: who holds it in some windows holds it in others."""
    one = held(angle)
    y, up = one.y.copy(), one.x.f / np.linalg.norm(one.x.f, axis=1, keepdims=True)
    push = 1.6e-2 * np.random.default_rng(3).standard_normal(len(y))
    y[:, :3] += push[:, None] * up
    rows = replace(one, y=y)
    assert force_wander_angle(rows) == 0.0, "a table may be shaken like that"
    found = hand_detection.force_wander_angle(rows, True)
    assert found == pytest.approx(angle, rel=0.1)


def test_a_jump_in_one_window_is_no_hand() -> None:
    """A hundred times the noise, which would be a hand if it counted in all of them."""
    one = held(0.0)
    y = one.y.copy()
    inside = np.flatnonzero(one.x.position == 4)
    y[inside[len(inside) // 2 :], :3] += 100 * SD[:3] * [1.0, -1.0, 0.5]
    assert force_wander_angle(replace(one, y=y)) == 0.0
    in_hand = held(2e-3)
    y = in_hand.y.copy()
    y[inside[len(inside) // 2 :], :3] += 0.1
    assert force_wander_angle(replace(in_hand, y=y)) > 2e-3


def test_a_course_that_windows_share_is_none_of_a_hand() -> None:
    one = held(0.0)
    y = one.y.copy()
    y[:, :3] += 0.1 * np.exp(-one.x.since_turn / 5.0)[:, None] * [1.0, -2.0, 0.5]
    assert force_wander_angle(replace(one, y=y)) == 0.0
    cut = one.x.position != 4
    cut |= one.x.since_turn < 20.0  # windows may be of different lengths
    sd = np.where(cut[:, None], one.sd, np.nan)
    assert force_wander_angle(replace(one, y=y, sd=sd)) == 0.0


def test_what_noise_walks_by_is_taken_off_a_tremor() -> None:
    """An integral of white noise about a line, by (1); in the mean of many."""
    rng, length, count = np.random.default_rng(6), 4.0, 200
    sigma = np.array([0.3, 2.0])
    white = sigma / np.sqrt(count)
    wave = 5.0 * np.cos(2 * np.pi * 1.5 * length * (np.arange(count) + 0.5) / count)
    wave *= 2 * np.pi * 1.5
    square = np.zeros((2, 2))
    for _ in range(300):
        noise = sigma * rng.standard_normal((count, 2))
        for k, values in enumerate((noise, noise + wave[:, None])):
            square[k] += tremor_rms(values, length, white) ** 2 / 300
    walked = (white * length) ** 2 / 15
    assert (square[0] < 0.5 * walked).all()
    np.testing.assert_allclose(square[1], 25.0 / 2, rtol=0.05)


def test_a_force_that_scatters_as_its_noise_does_is_held_by_no_hand() -> None:
    """Of fifty seeds in one at most; a hand turns it by three times as much."""
    x, found = ladder(12, EVERY), []
    for seed in range(50):
        rng = np.random.default_rng(seed)
        y = np.hstack([x.f, x.w]) + SD * rng.standard_normal((len(x), 6))
        found.append(force_wander_angle(rows_of(x, y)))
    assert np.count_nonzero(found) <= 1
