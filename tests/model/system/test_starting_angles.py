"""Where to begin to linearise a position that was set at quite another angle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_sessions import LADDER, dictionary, ladder, nominal, rows_of

from fieldcal.core.samples import Array
from fieldcal.model import thresholds
from fieldcal.model.search.gauss_newton import GaussNewton
from fieldcal.model.system.starting_angles import starting_angles
from fieldcal.model.system.window_rows import WindowSystem
from fieldcal.physics.experience import Experience

BIAS = np.array([0.3, -0.2, 0.25])
"""Of a device that nobody calibrated, m/s^2."""


def held_at(position: int, alpha: float, beta: float) -> Array:
    """Outputs, (n, 6), of a ladder with one position at other angles, deg."""
    x = ladder()
    other = Experience.at_rest(np.deg2rad([alpha]), np.deg2rad([beta]), x.gravity)
    f = x.f.copy()
    f[x.position == position] = other.f[0]
    return np.hstack([f + BIAS, x.w])


def turn_deg(y: Array, position: int) -> Array:
    found: Array = starting_angles(rows_of(ladder(), y), nominal(), position)
    return np.rad2deg(found)


@pytest.mark.parametrize("position", range(len(LADDER)))
def test_near_the_stated_angle_the_stated_angle_is_the_start(position: int) -> None:
    alpha, beta = LADDER[position]
    far = (
        np.rad2deg(thresholds.CONVERGES_WITHIN_RAD) - 2.5
    )  # the bias is worth up to 2.4 degrees
    assert not turn_deg(held_at(position, alpha + far, beta), position).any()


@pytest.mark.parametrize(("position", "other"), [(2, 7), (7, 1), (0, 2)])
def test_most_often_it_is_where_another_should_have_been(
    position: int, other: int
) -> None:
    turn = turn_deg(held_at(position, *LADDER[other]), position)
    np.testing.assert_allclose(LADDER[position] + turn, LADDER[other], atol=1e-9)


@pytest.mark.parametrize(
    ("alpha", "beta"), [(180, 0), (-90, 5), (135, -40), (90, 70), (-120, 0)]
)
def test_else_it_is_near_the_force_that_shows(alpha: float, beta: float) -> None:
    turn = np.deg2rad(turn_deg(held_at(2, alpha, beta), 2))
    assert (np.abs(turn) <= np.pi).all()
    start, held = (
        Experience.at_rest(a[:1], a[1:], 1.0).f[0]
        for a in (np.deg2rad(LADDER[2]) + turn, np.deg2rad([alpha, beta]))
    )
    assert np.linalg.norm(start - held) < thresholds.CONVERGES_WITHIN_RAD


def test_of_alike_orientations_the_smaller_turn_is_likelier() -> None:
    """The axis of beta is upright there, so that no force tells beta."""
    turn = turn_deg(held_at(2, 90.0, 70.0), 2)
    np.testing.assert_allclose(turn, [45.0, 0.0], atol=1e-9)


@pytest.mark.parametrize("axes", [(0, 1), (0,), ()])
def test_one_axis_alone_tells_no_orientation(axes: tuple[int, ...]) -> None:
    y = held_at(2, 180.0, 0.0)
    y[:, [c for c in range(3) if c not in axes]] = np.nan
    assert turn_deg(y, 2).any() == (len(axes) == 2)


def test_the_fit_begins_there_and_ends_at_the_angle() -> None:
    """From the stated angle it would end at the mirror image of the right one."""
    x, y = ladder(), held_at(2, -135.0, 0.0)
    d = dictionary(x)
    fit = GaussNewton(WindowSystem(rows_of(x, y), d), nominal())
    cause = next(c for c in d.causes if c.key == "misset 2")
    member = (cause, cause.variants[0])
    state, _, _ = fit.settle(fit.nominal, np.zeros(d.width), (member,))
    whole, beta = np.rad2deg(np.abs(state.small_rotation[2]))
    assert whole == pytest.approx(180.0, abs=1.0) and beta < 1.0
    begun = replace(fit.nominal, small_rotation=state.small_rotation.copy())
    assert not begun.small_rotation[[0, 1, *range(3, 9)]].any()
