"""What a state makes of the inputs, against devices that are turned by matrices."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fieldcal.core.frames import direction_cosines
from fieldcal.core.samples import Array
from fieldcal.effects import catalogue
from fieldcal.model.causes.basis import RowView, central_differences
from fieldcal.model.causes.columns import (
    attitude,
    attitude_sides,
    earth_rate_direction,
    speed,
)
from fieldcal.model.state import (
    State,
    Term,
    perpendicular_vectors,
    rotate_positions,
    tilt_positions,
)
from fieldcal.physics.experience import Experience

EFFECTS = catalogue()
RNG = np.random.default_rng(9)
POSITION = np.array([2, 2, 0, -1, 4, 1, 1])
ALPHA, BETA, GAMMA = RNG.uniform(-1.2, 1.2, (3, 6))[:, POSITION]
EARTH = np.array([0.0, 5e-5, 4e-5])
MOUNTING = np.array([[0.0, 1, 0], [0, 0, -1], [-1, 0, 0]])
SCALE = np.array([1.1, 0.9, 1.05, 1.02, 0.97, 1.01])


def rows(free: tuple[int, ...] = (), gamma: Array = GAMMA) -> Experience:
    """Rows in positions 0 to 4, of which 3 was left out; some of unknown angles."""
    alpha, beta = ALPHA.copy(), BETA.copy()
    alpha[list(free)] = np.nan
    return Experience.at_rest(
        alpha, beta, 9.81, position=POSITION, base_rate=EARTH, gamma=gamma,
        mounting=MOUNTING, f=np.tile([3.0, -8.0, 4.0], (7, 1)),
    )  # fmt: skip


def state(**changes: Any) -> State:
    zero = State(np.zeros(6), SCALE, np.zeros((5, 2)), np.zeros(3))
    return replace(zero, **changes)


def felt(held: Array, x: Experience) -> Array:
    """Force and rate in device axes, (n, 6), of direction cosines (n, 3, 3)."""
    return np.hstack([held @ v @ MOUNTING for v in (x.base_force, x.base_rate)])


@pytest.mark.parametrize("gamma", [GAMMA, np.zeros(7)], ids=["three", "two"])
def test_a_wrong_attitude_turns_a_device_about_axes_of_the_base(gamma: Array) -> None:
    """Each position by its own; not the way between, nor a position that is right."""
    x = rows(gamma=gamma)
    errors = RNG.normal(0.0, 0.2, (6, 3))
    errors[1] = 0.0
    found = tilt_positions(x, errors)
    back = Rotation.from_rotvec(-np.where(POSITION[:, None] < 0, 0, errors[POSITION]))
    held = direction_cosines(ALPHA, BETA, gamma) @ back.as_matrix()
    shown = np.hstack([found.f, found.w])
    np.testing.assert_allclose(shown, felt(held, x), atol=1e-12)
    for name, old in (("alpha", ALPHA), ("beta", BETA), ("gamma", gamma)):
        same = np.isin(POSITION, (-1, 1))
        np.testing.assert_array_equal(getattr(found, name)[same], old[same])
    turned = state(attitude=errors).turned(x)
    np.testing.assert_array_equal(turned.f, found.f)


def test_a_known_position_is_turned_by_its_two_angles() -> None:
    x, small = rows(), RNG.normal(0.0, 0.1, (5, 2))
    found = rotate_positions(x, small)
    own = np.where(POSITION[:, None] < 0, 0.0, small[POSITION])
    np.testing.assert_allclose(found.alpha, ALPHA + own[:, 0])
    np.testing.assert_allclose(found.beta, BETA + own[:, 1])
    held = direction_cosines(ALPHA + own[:, 0], BETA + own[:, 1], GAMMA)
    shown = np.hstack([found.f, found.w])
    np.testing.assert_allclose(shown, felt(held, x), atol=1e-12)


def across(vectors: Array, angles: Array, lengths: Array) -> Array:
    """Vectors turned aside by small angles along the two beside them, of a length."""
    one, two = perpendicular_vectors(vectors)
    aside = vectors + angles[:, :1] * one + angles[:, 1:] * two
    size = np.linalg.norm(aside, axis=1, keepdims=True)
    out: Array = aside / size * lengths[:, None]
    return out


def test_an_unknown_position_is_turned_across_its_force() -> None:
    """Gravity stays as large as it is; others are not touched by that."""
    free = (0, 1, 3, 5)
    x, small = rows(free), RNG.normal(0.0, 0.1, (5, 2))
    x.f[5] = 0.0  # no accelerometers: nothing tells the vertical
    found = rotate_positions(x, small)
    own = np.where(POSITION[:, None] < 0, 0.0, small[POSITION])
    known = rotate_positions(rows(), small)
    for k in range(7):
        if k in (0, 1, 3):
            size = np.linalg.norm(x.f[k : k + 1], axis=1)
            expected = across(x.f[k : k + 1], own[k : k + 1], size)[0]
            np.testing.assert_allclose(found.f[k], expected)
            np.testing.assert_array_equal(found.w[k], x.w[k])
        else:
            np.testing.assert_allclose(found.f[k], 0.0 if k == 5 else known.f[k])
    assert np.abs(found.f[:2] - x.f[:2]).max() > 0.1
    np.testing.assert_array_equal(found.f[3], x.f[3])


def test_the_axis_of_a_table_is_turned_and_its_speed_is_not() -> None:
    x, small = rows((0, 1, 3, 5)), RNG.normal(0.0, 0.1, (5, 2))
    w = RNG.normal(size=(7, 3))
    x.speed[[1, 5]] = 0.4, 0.7
    x = replace(x, w=w)
    found = rotate_positions(x, small)
    own, spun = small[POSITION], np.array([1, 5])
    expected = across(w[spun], own[spun], np.array([0.4, 0.7]))
    np.testing.assert_allclose(found.w[spun], expected)
    np.testing.assert_array_equal(found.w[[0, 3]], w[[0, 3]])


def test_two_vectors_lie_across_a_force_and_make_a_triad_with_it() -> None:
    """The first lies across the axis that the force has least of."""
    f = np.vstack([RNG.normal(0.0, 5.0, (6, 3)), [[0.0, -9.81, 0.0]]])
    one, two = perpendicular_vectors(f)
    size = np.linalg.norm(f, axis=1)
    triad = np.stack([f, one, two], axis=1) / size[:, None, None]
    whole = triad @ np.swapaxes(triad, 1, 2)
    np.testing.assert_allclose(whole, np.tile(np.eye(3), (7, 1, 1)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(triad), 1.0)
    for k, axis in enumerate(np.argmin(np.abs(f), axis=1)):
        assert abs(one[k, axis]) < 1e-12 * size[k]
        assert one[k] @ np.cross(f[k], np.eye(3)[axis]) > 0


def test_a_rate_of_the_base_adds_to_that_of_the_earth() -> None:
    x, more = rows(), np.array([1e-4, -2e-4, 3e-4])
    found = state(earth=more).turned(x)
    held = direction_cosines(ALPHA, BETA, GAMMA)
    np.testing.assert_allclose(found.w, held @ (EARTH + more) @ MOUNTING)
    np.testing.assert_array_equal(found.f, x.f)


def test_motions_act_in_their_order_and_sensors_add() -> None:
    """A base tilt first and then the angles' offset, as they stand in no list."""
    x = rows()
    tilt = Term(EFFECTS["base_tilt"], np.array([0.03, -0.02]))
    offset = Term(EFFECTS["angle_offset"], np.array([0.04, 0.05]))
    bent = Term(EFFECTS["quadratic"], np.array([1e-3, 2e-3, -1e-3]))
    bias = np.linspace(0.1, 0.6, 6)
    found = state(terms=(bent, tilt, offset), bias=bias)
    other = state(terms=(offset, bent, tilt), bias=bias)
    assert tilt.order != offset.order and bent.order == 0
    moved = found.experienced(x)
    first, last = sorted((tilt, offset), key=lambda t: t.order)
    one, two = first.effect, last.effect
    assert hasattr(one, "change") and hasattr(two, "change")
    expected = two.change(one.change(x, first.values), last.values)
    np.testing.assert_allclose(moved.f, expected.f, atol=1e-12)
    np.testing.assert_allclose(other.experienced(x).f, expected.f, atol=1e-12)
    plain = bias + SCALE * np.hstack([moved.f, moved.w])
    plain[:, :3] += bent.values * moved.f**2
    out = found.output(moved, x.since_turn[None])
    np.testing.assert_allclose(out, plain, atol=1e-12)


def test_what_settles_counts_from_its_own_instant() -> None:
    x, values = rows(), np.linspace(1e-3, 6e-3, 6)
    since = np.array([[1.0] * 7, [4.0] * 7, [9.0] * 7])
    settling = Term(EFFECTS["settling"], values, {"tau_s": 5.0}, origin=1)
    out = state(terms=(settling,)).output(x, since)
    plain = SCALE * np.hstack([x.f, x.w])
    np.testing.assert_allclose(out - plain, np.tile(values * np.exp(-4 / 5), (7, 1)))


# --- columns of these


def test_attitudes_change_the_way_as_they_change_the_windows() -> None:
    """By differences of whole rotations, also about a state that is turned already."""
    x = rows()
    view = RowView.of(x, np.zeros((1, 7)), state())
    table = central_differences(attitude_sides)(view)
    whole = attitude(view).reshape(7, 6, 5, 3).sum(axis=2)
    held = POSITION >= 0
    np.testing.assert_allclose(table[held], whole[held], atol=1e-8)
    assert not table[~held].any() and table.shape == (7, 6, 3)
    errors = RNG.normal(0.0, 0.1, (5, 3))
    about = state(attitude=errors)
    found = central_differences(attitude_sides)(RowView.of(x, np.zeros((1, 7)), about))
    for j, step in enumerate(1e-4 * np.eye(3)):
        up, down = (tilt_positions(x, errors + s) for s in (step, -step))
        change = np.hstack([up.f - down.f, up.w - down.w]) / 2e-4
        np.testing.assert_allclose(found[:, :, j], SCALE * change, atol=1e-6)


def test_a_measured_rate_of_the_earth_may_point_elsewhere() -> None:
    """Two small turns of each position that was measured by hand, and of no other."""
    x = rows((0, 1, 3, 5))
    w: Array = np.array([1e-5, -7e-5, 2e-5]) * np.arange(1.0, 8.0)[:, None]
    x = replace(x, w=w)
    x.w[5] = 0.0  # not measured there
    found = earth_rate_direction(RowView.of(x, np.zeros((1, 7)), state()))
    assert found.shape == (7, 6, 10)
    one, two = perpendicular_vectors(w[:2])
    np.testing.assert_allclose(found[:2, 3:, 4], SCALE[3:] * one)
    np.testing.assert_allclose(found[:2, 3:, 5], SCALE[3:] * two)
    found[:2, 3:, 4:6] = 0.0
    assert not found.any()


def test_a_speed_may_be_another_in_all_rows_that_have_it() -> None:
    x = replace(rows(), w=RNG.normal(size=(7, 3)))
    x.speed[[1, 5]], x.speed[2] = 0.4, 0.7
    found = speed(np.array([0.4, 0.7]))(RowView(x, x, np.zeros((1, 7)), state()))
    for j, at in enumerate(([1, 5], [2])):
        expected = np.zeros((7, 6))
        expected[at, 3:] = SCALE[3:] * x.w[at]
        np.testing.assert_allclose(found[:, :, j], expected)


def test_what_is_sensed_changes_before_the_scale_factors_mirrored_ones_too() -> None:
    """A device that slips in its mount turns the force, and an axis may be mirrored."""
    mirrored = SCALE * [-1.0, 1.0, 1.0, 1.0, -1.0, 1.0]
    axis, x = np.array([0.3, -0.5, 0.8]), rows()
    slips = Term(EFFECTS["mount_slip"], axis, {"at_s": -np.inf})
    plain = State(np.zeros(6), mirrored, np.zeros((5, 2)), np.zeros(3))
    found = replace(plain, terms=(slips,)).output(x, np.zeros((1, len(x))))
    back = Rotation.from_rotvec(np.deg2rad(axis)).inv()
    expected = mirrored * np.hstack([back.apply(x.f), back.apply(x.w)])
    np.testing.assert_allclose(found, expected, atol=1e-12)
