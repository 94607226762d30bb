"""A turn's own arithmetic, against sums that are written out edge by edge."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_sessions import ladder, nominal

from fieldcal.core.rotation import rotation_matrices
from fieldcal.core.samples import Array
from fieldcal.effects import catalogue
from fieldcal.model.causes import columns
from fieldcal.model.causes.basis import RowView
from fieldcal.model.state import State, Term
from fieldcal.model.turns.turn import Turn
from fieldcal.model.turns.turn_tracker import apply_way_effects, other_gyro_errors
from fieldcal.physics.experience_rows import select_rows

M, STEP, INTERVAL = 12, 0.05, 0.01
RNG = np.random.default_rng(6)
SCALE = np.array([1.1, 0.9, 1.05])


def turn() -> Turn:
    """Twelve steps of a turn about an axis that changes, in three pieces."""
    x = ladder(3)
    at = np.isin(x.position, (2, 3))
    ends = select_rows(x, np.flatnonzero(at).tolist())
    ends = replace(ends, f=ends.f + 0.1 * RNG.standard_normal(ends.f.shape))
    t = 7.0 + STEP * np.arange(M + 1)
    edges = select_rows(x, list(range(M + 1)))
    angle = np.cumsum(RNG.uniform(0, 0.1, (M + 1, 3)), axis=0)
    done = np.linspace(0, 1, M + 1) ** 2
    return Turn(
        (2, 3), ends, replace(edges, t=t), edges.f, rotation_matrices(-angle), done,
        np.array([0, 4, 7, M]), np.zeros((3, 3)), np.ones((3, 3)), 0.0, INTERVAL,
    )  # fmt: skip


ONE = turn()
OFF = RNG.standard_normal((M + 1, 3, 2))


def phi_of(off: Array) -> Array:
    """(1), step by step by the trapezoid rule, (m + 1, 3, k)."""
    back = [ONE.attitude[k].T @ off[k] for k in range(M + 1)]
    phi = [np.zeros((3, off.shape[2]))]
    for k in range(M):
        phi.append(phi[-1] + STEP * (back[k] + back[k + 1]) / 2)
    return np.array(phi)


def test_a_closure_is_the_sum_of_what_the_rates_are_off_by() -> None:
    weights = ONE.weights(SCALE)
    found = np.einsum("ijc,jck->ik", weights, OFF)
    np.testing.assert_allclose(found, phi_of(OFF / SCALE[:, None])[-1], atol=1e-12)


def test_on_the_way_it_is_less_its_share_of_the_closure() -> None:
    phi = phi_of(OFF)
    expected = [p - u * phi[-1] for p, u in zip(phi, ONE.done, strict=True)]
    np.testing.assert_allclose(ONE.attitude_error(OFF), expected, atol=1e-12)


def test_what_is_off_swings_the_force_of_the_first_position() -> None:
    f = ONE.ends.f[ONE.ends.position == 2].mean(axis=0)
    found = ONE.force_error(OFF)
    for k in range(M + 1):
        for j in range(2):
            expected = ONE.attitude[k] @ np.cross(OFF[k, :, j], f)
            np.testing.assert_allclose(found[k, :, j], expected, atol=1e-12)


def test_means_over_pieces_are_those_of_the_samples() -> None:
    """A square, by the trapezoid rule of samples 10 ms apart, not of edges 50 ms."""
    found = ONE.means((ONE.t - 7.0) ** 2)
    for k, (a, b) in enumerate([(0, 4), (4, 7), (7, M)]):
        t = np.arange(round(a * 5), round(b * 5) + 1) * INTERVAL
        mean = np.trapezoid(t**2, t) / (t[-1] - t[0])
        assert found[k] == pytest.approx(mean, abs=(1e-12 if k == 1 else 1e-4))
    both = ONE.means(np.stack([ONE.t, 2 * ONE.t], axis=1))
    np.testing.assert_allclose(both[:, 1], 2 * both[:, 0])
    np.testing.assert_allclose(both[:, 0], [7.1, 7.275, 7.475])


def test_what_a_state_has_wrong_of_the_rates_beside_bias_scale_and_delay() -> None:
    effects = catalogue()
    x = replace(ladder(1), w=RNG.standard_normal((9, 3)))
    coupling = np.linspace(-0.02, 0.02, 6)
    terms = (
        Term(effects["gyro_cross_coupling"], coupling),
        Term(effects["time_delay"], np.array([0.02])),
        Term(effects["settling"], np.full(6, 1e-3), {"tau_s": 4.0}),
    )
    base = nominal()
    state = State(base.bias + 0.3, base.scale * 1.2, base.small_rotation, base.earth,
                  terms)  # fmt: skip
    since = x.since_turn[None]
    found = other_gyro_errors(state, x, since)
    names = [p.name for p in effects["gyro_cross_coupling"].params]
    matrix = np.zeros((3, 3))
    for name, value in zip(names, coupling, strict=True):
        matrix[int(name[1]) - 1, int(name[2]) - 1] = value
    settling = 1e-3 * np.exp(-x.since_turn / 4.0)[:, None]
    np.testing.assert_allclose(found, x.w @ matrix.T + settling, atol=1e-12)


def test_only_what_acts_on_the_way_moves_what_is_felt_there() -> None:
    effects, x = catalogue(), replace(ladder(1), w=RNG.standard_normal((9, 3)))
    lever, tilt = np.array([0.1, 0.0, -0.2]), np.array([1.0, 2.0])
    terms = (Term(effects["base_tilt"], tilt), Term(effects["lever_arm"], lever))
    state = replace(nominal(), terms=terms)
    found = apply_way_effects(x, state)
    expected = x.f + np.cross(x.w, np.cross(x.w, lever))
    np.testing.assert_allclose(found.f, expected, atol=1e-12)
    np.testing.assert_array_equal(found.w, x.w)


def test_sides_of_small_rotations_are_their_columns() -> None:
    """All positions at once, of which each has its own columns."""
    x, state = ladder(2), nominal()
    view = RowView.of(x, x.since_turn[None], state)
    whole = columns.small_rotation(view)
    pairs = list(columns.small_rotation_sides(view))
    assert len(pairs) == 2
    for joint, (up, down, step) in enumerate(pairs):
        assert step == 1e-5
        change = np.hstack([up.f - down.f, up.w - down.w]) / (2 * step)
        own = np.zeros_like(whole)
        own[np.arange(len(x)), :, 2 * x.position + joint] = change
        others = np.arange(18) % 2 == joint
        np.testing.assert_allclose(whole[:, :, others], own[:, :, others], atol=1e-9)


def test_some_rows_keep_what_they_have() -> None:
    x = ladder(2)
    some = select_rows(x, [3, 11])
    rows = [
        "alpha", "beta", "f", "w", "w_dot", "t", "since_start", "since_turn",
        "warming", "heating", "variance", "position", "rate", "lasts",
    ]  # fmt: skip
    for name in rows:
        np.testing.assert_array_equal(getattr(some, name), getattr(x, name)[[3, 11]])
    assert some.gravity == x.gravity and some.latitude == x.latitude
