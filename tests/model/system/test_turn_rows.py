"""What is known of closures and of the way, against matrices written out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_sessions import dictionary, ladder, nominal, rows_of

from fieldcal.core.samples import Array
from fieldcal.effects import catalogue
from fieldcal.model.causes.basis import RowView
from fieldcal.model.causes.effect_columns import effect_basis
from fieldcal.model.evidence.sets import Set, Sets
from fieldcal.model.state import Term
from fieldcal.model.system import turn_force_rows, turn_rows
from fieldcal.model.system.linear_system import gram
from fieldcal.model.system.turn_rows import TurnRows
from fieldcal.model.system.window_rows import WindowSystem
from fieldcal.physics.effect import Motion

EFFECTS = catalogue()
X = ladder()
RNG = np.random.default_rng(8)
UP = np.array([2.0, -1.0, 2.0]) / 3.0
LEVEL = np.eye(3) - np.outer(UP, UP)


@pytest.mark.parametrize("across", [np.eye(3), LEVEL], ids=["all", "level"])
@pytest.mark.parametrize("ends", [0.0, 1.0])
def test_the_information_of_a_closure_is_what_its_covariance_leaves(
    across: Array, ends: float
) -> None:
    root = ends * RNG.standard_normal((3, 3))
    cov = root @ root.T
    basis, info = turn_rows._known_axes(across, cov, 0.25)
    assert len(basis) == round(np.trace(across))
    np.testing.assert_allclose(basis @ basis.T, np.eye(len(basis)), atol=1e-12)
    whole = across @ (cov + 0.25 * np.eye(3)) @ across
    expected = np.linalg.pinv(whole, rcond=1e-9)
    np.testing.assert_allclose(basis.T @ np.diag(info) @ basis, expected, atol=1e-9)


def turn(way: Array, design: Array) -> TurnRows:
    at = np.arange(design.shape[1])
    none = np.zeros((0, len(at)))
    return TurnRows((0, 1), np.zeros(0), at, none, np.zeros(0), np.zeros((0, 3)),
                    way, design)  # fmt: skip


@pytest.mark.parametrize(("size", "kept"), [(1.0, True), (1.6, True), (1.9, False)])
def test_a_way_that_a_hand_shook_says_nothing(size: float, kept: bool) -> None:
    """From three squares a row on, with everything fitted that shows there."""
    rows = []
    for _ in range(2):
        design = np.hstack([RNG.standard_normal((300, 3)), np.zeros((300, 1))])
        way = size * RNG.standard_normal(300) + design @ [90.0, -70.0, 50.0, 0.0]
        rows.append(turn(way, design))
    found = turn_rows._drop_shaken_way(rows)
    assert [len(r.way) for r in found] == [300 * kept] * 2
    assert [r.way_design.shape for r in found] == [(300 * kept, 4)] * 2
    assert turn_rows._drop_shaken_way([]) == []


def test_what_no_physics_makes_of_accelerometers_at_rest_is_strange() -> None:
    d = dictionary(X)
    linear = WindowSystem(rows_of(X, np.hstack([X.f, X.w])), d).linearised(nominal())
    sets = Sets(d, gram(linear, d, np.zeros(d.width)))
    causes = {c.key: c for c in d.causes}

    def having(key: str) -> Set:
        return sets.evaluate(((causes[key], causes[key].variants[0]),))

    assert turn_rows._has_unknown_acc_cause(
        having("time:ay")
    ) and turn_rows._has_unknown_acc_cause(having("time:acc"))
    for key in ("time:gy", "settling:acc", "random_walk:acc"):
        assert not turn_rows._has_unknown_acc_cause(having(key))


SETTLING = Term(EFFECTS["settling"], np.linspace(-2e-3, 3e-3, 6), {"tau_s": 5.0})


def test_what_begins_to_fade_at_the_end_of_a_turn_is_its_size() -> None:
    state = replace(nominal(), bias=np.full(6, 0.3), terms=(SETTLING,))
    found = turn_force_rows.settling_amplitudes(state, X, X.since_turn[None])
    np.testing.assert_allclose(found, SETTLING.values, atol=1e-15)
    assert not turn_force_rows.settling_amplitudes(
        nominal(), X, X.since_turn[None]
    ).any()


def test_what_settles_builds_up_smoothly_and_is_known_better_afterwards() -> None:
    t = 100.0 + np.linspace(0.0, 8.0, 33)
    x = replace(X, t=t)
    since = np.where(t >= 105.0, t - 105.0, np.inf)[None]
    middle = np.array([0.5, 4.9, 5.29, 5.31, 7.0])
    found = turn_force_rows._settling_covariance(x, since, middle)
    size = np.array([0.5, 0.5, 0.5, 0.15, 0.15])
    apart = (middle[:, None] - middle) / 2.0
    np.testing.assert_allclose(found, np.outer(size, size) * np.exp(-(apart**2) / 2))
    never = turn_force_rows._settling_covariance(
        x, np.full((1, 33), np.inf), np.array([1.0, 8.2, 8.4])
    )
    np.testing.assert_allclose(np.diag(never), [0.25, 0.25, 0.0225])


def test_columns_on_the_way_are_what_an_effect_changes_there() -> None:
    """By the scale factors, and by what is coupled to what it moves."""
    effect, w = EFFECTS["lever_arm"], RNG.standard_normal((len(X), 3))
    assert isinstance(effect, Motion) and effect.on_the_way
    coupling = Term(EFFECTS["cross_coupling"], np.linspace(-0.02, 0.03, 6))
    state = replace(nominal(), scale=np.linspace(0.9, 1.2, 6), terms=(coupling,))
    x, since = replace(X, w=w, w_dot=0.3 * w[::-1]), X.since_turn[None]
    found = effect_basis(effect, {}, 0).evaluate(RowView(x, x, since, state))
    for j, step in enumerate(1e-4 * np.eye(3)):
        up, down = (state.output(effect.change(x, s), since) for s in (step, -step))
        np.testing.assert_allclose(found[:, :, j], (up - down) / 2e-4, atol=1e-6)
