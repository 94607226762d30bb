"""What of a turn is known at its ends, and how it is cut, by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fieldcal.core.frames import direction_cosines
from fieldcal.core.rotation import cross_matrix, rotation_matrices
from fieldcal.core.samples import Array, Block
from fieldcal.model import resolutions, thresholds
from fieldcal.model.rows.row_source import RowSource
from fieldcal.model.rows.thermometer import Thermometer
from fieldcal.model.turns.attitude import (
    accelerations,
    antisymmetric_vector,
    contradicts_force,
    interpolate_vectors,
    sampling_error,
    trapezoid_means,
    turn_geometry,
)
from fieldcal.model.turns.integration import Leg, divide_into_steps, integrate_turn
from fieldcal.model.turns.rotation import mean_rates, products
from fieldcal.physics.experience import Experience
from fieldcal.session.description_file import parse_description

MOUNTING = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
ALPHA, BETA = np.deg2rad([20.0, 70.0]), np.deg2rad([5.0, -30.0])
RNG = np.random.default_rng(2)


def ends(known: bool = True) -> Experience:
    """Two positions, of three rows and of two."""
    at = np.array([0, 0, 0, 1, 1])
    x = Experience.at_rest(ALPHA[at], BETA[at], 9.8, position=at, mounting=MOUNTING)
    hidden = x.alpha if known else np.full(5, np.nan)
    return replace(x, alpha=hidden)


def way() -> Array:
    """The turn from the first position to the second in device axes, (3, 3)."""
    first, second = direction_cosines(ALPHA, BETA)
    turned: Array = MOUNTING.T @ second @ first.T @ MOUNTING
    return turned


SMALL = np.array([2e-4, -1e-4, 3e-4])


def test_a_closure_is_what_the_attitude_is_off_by() -> None:
    """R (I + [phi]x) is the true attitude."""
    x, reached = ends(), way() @ rotation_matrices(-SMALL)
    attitude = np.array([np.eye(3), reached])
    done = np.array([0.0, 1.0])
    f, closure, across = turn_geometry(x, (0, 1), attitude, done)
    np.testing.assert_allclose(closure, SMALL, atol=1e-9)
    np.testing.assert_array_equal(across, np.eye(3))
    np.testing.assert_allclose(f, x.f[[0, 3]], atol=1e-12)


def test_without_angles_it_is_known_across_the_force() -> None:
    x, reached = ends(False), way() @ rotation_matrices(-SMALL)
    attitude = np.array([np.eye(3), reached])
    _, closure, across = turn_geometry(x, (0, 1), attitude, np.array([0.0, 1.0]))
    up = x.f[0] / np.linalg.norm(x.f[0])
    np.testing.assert_allclose(across, np.eye(3) - np.outer(up, up), atol=1e-12)
    np.testing.assert_allclose(closure, across @ SMALL, atol=1e-7)


@pytest.mark.parametrize(("off", "lost"), [(0.29, False), (0.31, True), (-3.0, True)])
def test_an_attitude_that_is_far_off_is_lost(off: float, lost: bool) -> None:
    """About the vertical it is the stated angles that are another's."""
    x, f = ends(), ends().f[0] / np.linalg.norm(ends().f[0])
    across = np.cross(f, [0.3, -0.8, 0.5])
    across /= np.linalg.norm(across)
    assert thresholds.MAX_MISCLOSURE_RAD == 0.3
    assert contradicts_force(x, (0, 1), way() @ rotation_matrices(off * across)) == lost
    about = way() @ rotation_matrices(off * f)
    assert not contradicts_force(x, (0, 1), about)
    _, closure, known = turn_geometry(
        x, (0, 1), np.array([np.eye(3), about]), np.array([0, 1])
    )
    assert (np.trace(known) < 2.5) == lost
    if not lost:
        np.testing.assert_allclose(closure, -np.sin(off) * f, atol=1e-9)


def test_between_ends_a_vector_is_as_near_as_the_turn_is_done() -> None:
    attitude = rotation_matrices(-np.outer(np.linspace(0, 1, 4), [0.5, -0.2, 0.9]))
    done, start, end = np.array([0.0, 0.25, 0.75, 1.0]), RNG.random(3), RNG.random(3)
    found = interpolate_vectors(attitude, done, start, end)
    for k in range(4):
        one, two = attitude[k] @ start, attitude[k] @ attitude[3].T @ end
        np.testing.assert_allclose(found[k], (1 - done[k]) * one + done[k] * two)


def test_means_of_what_goes_straight_between_instants() -> None:
    t = np.array([0.0, 1.0, 1.5, 4.0, 5.0])
    values = np.column_stack([2.0 + 3.0 * t, t])
    found = trapezoid_means(t, values, np.array([0, 2, 4]))
    np.testing.assert_allclose(found, [[2 + 3 * 0.75, 0.75], [2 + 3 * 3.25, 3.25]])
    np.testing.assert_allclose(trapezoid_means(t, t**0 * 7.0, np.array([1, 3])), [7.0])


def test_an_angular_acceleration_is_the_slope_of_means() -> None:
    t = np.arange(0.0, 5.0, 0.02)
    w = np.column_stack([0.3 * t, -2.0 * t, 0.0 * t])
    inside = slice(10, -10)
    np.testing.assert_allclose(
        accelerations(t, w)[inside], np.tile([0.3, -2.0, 0.0], (250, 1))[inside],
        atol=1e-9,
    )  # fmt: skip
    step = (t > 2.5).astype(float)[:, None] * [1.0, 0.0, 0.0]
    found = accelerations(t, step)[:, 0]
    assert found.max() == pytest.approx(10.0, rel=0.01), "over 0.1 s"
    assert (found > 1e-9).sum() == 6
    coarse = accelerations(np.arange(10.0), np.arange(10.0)[:, None] ** 2)
    np.testing.assert_allclose(coarse[1:-1, 0], 2 * np.arange(1.0, 9.0))


@pytest.mark.parametrize("each", [1, 4])
def test_blur_is_what_a_turn_in_half_the_steps_comes_out_otherwise_by(
    each: int,
) -> None:
    """Coning, whose attitude is known; of noise alone there is none."""
    t = np.arange(401) / 100.0
    a, hz = 0.02, 8.0
    phase = 2 * np.pi * hz * t
    w = a * 2 * np.pi * hz * np.column_stack([np.cos(phase), np.sin(phase), 0 * t])
    missed = sampling_error(t, w, each, np.zeros(3))
    assert 1e-5 < missed < 1e-2
    for turned in (w[:, [2, 0, 1]], w[:, [1, 2, 0]]):
        assert sampling_error(t, turned, each, np.zeros(3)) == pytest.approx(
            missed, rel=1e-6
        )
    noise = 5e-3
    chance = 3 * noise**2 * 4.0**2 / 401
    found = sampling_error(t, w, each, np.full(3, noise))
    assert found == pytest.approx(np.sqrt(max(missed**2 - chance / 9, 0.0)), rel=1e-6)
    white = noise * np.random.default_rng(1).standard_normal((401, 3))
    assert sampling_error(t, white, each, np.full(3, noise)) < 1e-3
    assert sampling_error(t, 0 * w + [0.1, 0.2, 0.3], each, np.zeros(3)) < 1e-12


def test_matrices_of_vectors() -> None:
    v, a = RNG.standard_normal((2, 5, 3))
    matrix = cross_matrix(v)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", matrix, a), np.cross(v, a))
    np.testing.assert_allclose(antisymmetric_vector(matrix), v)
    lopsided = matrix + RNG.random((5, 1, 1)) * np.eye(3)
    np.testing.assert_allclose(antisymmetric_vector(lopsided), v)


@pytest.mark.parametrize("size", [0.0, 1e-9, 0.3, 3.0])
def test_exponentials_are_rotations_about_their_vector(size: float) -> None:
    axis = np.array([2.0, -1.0, 2.0]) / 3.0
    found = rotation_matrices(size * axis)
    np.testing.assert_allclose(found @ found.T, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(found @ axis, axis, atol=1e-14)
    assert (np.trace(found) - 1) / 2 == pytest.approx(np.cos(size))
    np.testing.assert_allclose(
        antisymmetric_vector(found), np.sin(size) * axis, atol=1e-14
    )


@pytest.mark.parametrize("n", [1, 2, 5, 16])
def test_products_are_those_one_after_another(n: int) -> None:
    steps = rotation_matrices(RNG.standard_normal((n, 3)))
    found = products(steps)
    whole = np.eye(3)
    for k in range(n):
        whole = steps[k] @ whole
        np.testing.assert_allclose(found[k], whole, atol=1e-13)


def test_mean_rates_between_samples_are_of_the_fourth_order() -> None:
    t = np.arange(6.0)
    w = np.column_stack([t**3, t**2, t])
    exact = np.column_stack([np.diff(t ** (n + 1)) / (n + 1) for n in (3, 2, 1)])
    np.testing.assert_allclose(mean_rates(t, w)[1:-1], exact[1:-1], rtol=1e-12)
    np.testing.assert_allclose(mean_rates(t[:2], w[:2]), [[0.5, 0.5, 0.5]])


def leg(rate_hz: float, seconds: float, w: Array, **more: Array | float) -> Leg:
    """A turn at even rates from 2 s on, of a device with errors."""
    t = np.arange(round((seconds + 4.0) * rate_hz)) / rate_hz
    block = Block.of(t, np.zeros((len(t), 3)), np.tile(w, (len(t), 1)))
    source = RowSource(
        block, parse_description({"format": 1}), np.ones((len(t), 6), dtype=bool),
        np.zeros(1),
        Thermometer.of(block),
    )  # fmt: skip
    first = round(2.0 * rate_hz)
    x = replace(ends(), w=np.zeros((5, 3)))
    known = {"bias": np.zeros(3), "scale": np.ones(3), "delay": 0.0} | more
    last = first + round(seconds * rate_hz)
    return Leg(source, x, pair=(0, 1), first=first, last=last, **known)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("rate_hz", "each", "piece"), [(25.0, 1, 4), (200.0, 4, 8), (1000.0, 20, 7)]
)
def test_a_turn_is_cut_into_steps_of_20_ms_and_pieces_of_150(
    rate_hz: float, each: int, piece: int
) -> None:
    found = divide_into_steps(leg(rate_hz, 3.0, np.ones(3)))
    assert found is not None and found.each == each
    count = (round(3.0 * rate_hz) - 1) // each
    np.testing.assert_array_equal(found.edge, np.arange(count + 1) * each)
    assert found.cut[0] == 0 and found.cut[-1] == count
    assert (np.diff(found.cut)[:-1] == piece).all()
    assert piece / 2 <= np.diff(found.cut)[-1] <= 1.5 * piece + 1
    assert found.first == round(2.0 * rate_hz) and found.t[0] == 2.0
    assert len(found.t) == count * each + 1
    np.testing.assert_array_equal(found.at, found.t[found.edge])


def test_a_turn_of_few_steps_is_none_and_a_long_one_has_no_more_pieces() -> None:
    assert divide_into_steps(leg(100.0, 0.16, np.ones(3))) is None
    found = divide_into_steps(leg(100.0, 0.19, np.ones(3)))
    assert found is not None and len(found.edge) == 10
    long = divide_into_steps(leg(100.0, 50.0, np.ones(3)))
    assert long is not None and resolutions.MAX_WAY_MEANS - 1 <= len(long.cut) - 1 <= 60


def test_integrated_rates_are_rid_of_what_is_known() -> None:
    """Bias, scale factor, errors and the clock's pace, of a turn about one axis."""
    w = np.array([0.0, 0.0, 0.5])
    bias, scale = np.array([0.01, -0.02, 0.03]), np.array([1.0, 1.0, 1.25])
    one = leg(100.0, 2.01, bias + scale * w + [0.0, 0.0, 0.1], bias=bias, scale=scale)
    steps = divide_into_steps(one)
    assert steps is not None
    rid = np.tile([0.0, 0.0, 0.1], (len(steps.edge), 1))
    found = integrate_turn(one, steps, rid)
    np.testing.assert_allclose(found.rate, np.tile(w, (201, 1)), atol=1e-12)
    expected = rotation_matrices(np.array([0, 0, -1.0]))
    np.testing.assert_allclose(found.attitude[-1], expected, atol=1e-9)
    np.testing.assert_allclose(found.done, np.linspace(0, 1, 101), atol=1e-9)
    slow = replace(one, source=replace(one.source, pace=2.0))
    np.testing.assert_allclose(
        integrate_turn(slow, steps, rid).attitude[-1],
        rotation_matrices(np.array([0, 0, -0.5])),
        atol=1e-9,
    )  # fmt: skip


def test_the_earth_turns_with_the_device_on_the_way() -> None:
    one = leg(100.0, 2.01, np.array([0.0, 0.0, 0.5]))
    start = np.array([3e-5, 4e-5, 0.0])
    end = rotation_matrices(np.array([0.0, 0.0, -1.0])) @ start
    x = replace(one.x, w=np.array([start] * 3 + [end] * 2))
    steps = divide_into_steps(one)
    assert steps is not None
    one, none = replace(one, x=x), np.zeros((len(steps.edge), 3))
    found = integrate_turn(one, steps, none)
    turned = rotation_matrices(-found.rate * (steps.t - steps.t[0])[:, None]) @ start
    np.testing.assert_allclose(found.earth, turned, atol=1e-8)
    less = none + [0.0, 0.0, 1e-3]
    near = integrate_turn(one, steps, less, found)
    np.testing.assert_allclose(
        near.attitude, integrate_turn(one, steps, less).attitude, rtol=0, atol=1e-7
    )
    assert np.abs(near.attitude[-1] - found.attitude[-1]).max() > 1e-3


def test_rates_that_are_late_are_taken_later() -> None:
    one = leg(100.0, 2.01, np.zeros(3))
    gyr = np.outer(one.source.block.t, [1.0, -1.0, 2.0])
    ramp = replace(one.source, block=replace(one.source.block, gyr=gyr))
    steps = divide_into_steps(one)
    assert steps is not None
    late = replace(one, source=ramp, delay=0.03)
    found = integrate_turn(late, steps, np.zeros((len(steps.edge), 3)))
    expected = np.outer(steps.t + 0.03, [1.0, -1.0, 2.0])
    np.testing.assert_allclose(found.rate, expected, atol=1e-12)
