"""What a turn meets of columns at its ends, against one position changed by hand."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from small_sessions import ladder, nominal

from fieldcal.core.rotation import rotation_matrices
from fieldcal.core.samples import Array
from fieldcal.effects import catalogue
from fieldcal.model.causes import columns
from fieldcal.model.causes.basis import General
from fieldcal.model.causes.effect_columns import effect_basis
from fieldcal.model.state import State, Term
from fieldcal.model.system.end_columns import EndColumns, positions_about
from fieldcal.model.turns.attitude import turn_geometry
from fieldcal.model.turns.turn import Turn
from fieldcal.physics.experience import Experience
from fieldcal.physics.experience_rows import select_rows

M, STEP = 8, 1e-5
SCALE = np.linspace(0.9, 1.2, 6)
PAIR = (2, 3)
SMALL = np.linspace(-0.01, 0.02, 18).reshape(9, 2)
STATE = replace(nominal(), small_rotation=SMALL)
RATE = np.array([3e-5, -6e-5, 2e-5])
ALL = ladder(2, base_rate=RATE)
FREE = ladder(2, free=(3,), base_rate=RATE)


def turn(x: Experience) -> Turn:
    """From one position to the other, a little wrong; halfway somewhere else."""
    known = ladder(2).to_device
    p, q = (int(np.argmax(x.position == i)) for i in PAIR)
    whole = rotation_matrices(np.array([1e-3, -2e-3, 5e-4])) @ known[q] @ known[p].T
    some = rotation_matrices(
        np.linspace(0.0, 0.3, M + 1)[:, None] * np.array([1, 2, -1])
    )
    attitude = np.concatenate([some[:-1], whole[None]])
    t = np.linspace(0.0, 2.0, M + 1)
    edges = replace(select_rows(x, list(range(M + 1))), t=t)
    ends, done = STATE.experienced(x), np.linspace(0, 1, M + 1) ** 2
    return Turn(
        PAIR, ends, edges, edges.f, attitude, done, np.array([0, M]),
        np.zeros((1, 3)), np.ones((1, 3)), 0.0, 0.01,
    )  # fmt: skip


def columns_of(basis: General, first: int, one: Turn, x: Experience) -> Any:
    """Columns of a turn that is calculated together with another, longer one."""
    more = np.repeat(one.attitude, 2, axis=0)
    other = replace(
        one, positions=PAIR[::-1], attitude=more, done=np.repeat(one.done, 2)
    )
    at_ends = EndColumns.of(first, basis, positions_about(x, STATE))
    _, found = at_ends.columns_of([other, one], SCALE)
    return found


def seen(one: Turn, state: State, x: Experience) -> tuple[Array, Array]:
    """Outputs at the edges (m + 1, 6) and closure of a state, one edge by the other."""
    there = state.experienced(x)
    f, closure, _ = turn_geometry(there, PAIR, one.attitude, one.done)
    p, q = (int(np.argmax(x.position == i)) for i in PAIR)
    end = one.attitude[-1]
    w = [
        (1 - u) * r @ there.w[p] + u * r @ end.T @ there.w[q]
        for r, u in zip(one.attitude, one.done, strict=True)
    ]
    return np.hstack([f, w]) * SCALE, closure


@pytest.mark.parametrize("x", [ALL, FREE], ids=["all known", "one free"])
def test_small_rotations_are_met_at_both_ends_and_nowhere_else(x: Experience) -> None:
    sides = columns.small_rotation_sides
    basis = General("aside", columns.small_rotation, sides=sides, per_position=True)
    one = turn(x)
    at, outputs, moved = columns_of(basis, 5, one, x)
    np.testing.assert_array_equal(at, 5 + np.array([4, 5, 6, 7]))
    for k, (p, i) in enumerate([(2, 0), (2, 1), (3, 0), (3, 1)]):
        both = []
        for sign in (1.0, -1.0):
            small = SMALL.copy()
            small[p, i] += sign * STEP
            both.append(seen(one, replace(STATE, small_rotation=small), x))
        change = [(a - b) / (2 * STEP) for a, b in zip(*both, strict=True)]
        np.testing.assert_allclose(outputs[:, :, k], change[0], atol=1e-9)
        np.testing.assert_allclose(moved[:, k], change[1], atol=1e-9)


def test_an_effect_is_met_at_both_ends_at_once() -> None:
    effect = catalogue()["angle_offset"]
    basis, one = effect_basis(effect, {}, 0), turn(ALL)
    at, outputs, moved = columns_of(basis, 40, one, ALL)
    np.testing.assert_array_equal(at, [40, 41])
    for k in range(2):
        both = []
        for sign in (1.0, -1.0):
            values = sign * 1e-3 * np.eye(2)[k]
            state = replace(STATE, terms=(Term(effect, values),))
            both.append(seen(one, state, ALL))
        change = [(a - b) / 2e-3 for a, b in zip(*both, strict=True)]
        np.testing.assert_allclose(outputs[:, :, k], change[0], atol=1e-7)
        np.testing.assert_allclose(moved[:, k], change[1], atol=1e-7)


def test_what_changes_nothing_in_positions_is_refused() -> None:
    with pytest.raises(ValueError, match="bias changes nothing in positions"):
        EndColumns.of(0, General("bias", columns.bias), positions_about(ALL, STATE))
