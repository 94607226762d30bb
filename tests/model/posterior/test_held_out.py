"""Rows foretold from the other positions, against a dense refit without them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from dense_model import Dense, shared
from numpy.typing import NDArray
from small_sessions import LADDER, dictionary, ladder, nominal, rows_of

from fieldcal.core.samples import Array
from fieldcal.model import priors, resolutions, tolerances
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.evidence.sets import Set, Sets
from fieldcal.model.posterior import held_out
from fieldcal.model.posterior.held_out import (
    HeldOut,
    candidate_sets,
    folds,
    held_out_residuals,
    held_out_turn_residuals,
)
from fieldcal.model.system.fitted import FittedSet, estimates_by_column
from fieldcal.model.system.linear_system import gram
from fieldcal.model.system.window_rows import WindowSystem
from fieldcal.physics.experience_rows import select_rows

ROWS = 3 * len(LADDER)


@dataclass(frozen=True)
class Refit:
    """A session, fitted, and its rows written out.

    Attributes
    ----------
    fitted : with a given set of causes
    dense : rows (n 6) with all columns, y - h + Phi u
    off : (n, 6) y - h of the state

    """

    fitted: FittedSet
    dense: Dense
    off: Array

    @property
    def dictionary(self) -> Dictionary:
        return self.fitted.dictionary

    def without(self, left: NDArray[np.bool_]) -> tuple[Array, Array]:
        """Estimates of all columns from the rest, and sizes of all."""
        kept = np.repeat(~left, 6)
        rest = Dense(
            self.dense.y[kept], self.dense.design[kept],
            self.dense.cov[np.ix_(kept, kept)], self.dense.white[kept],
        )  # fmt: skip
        state = self.fitted.set.state
        mean, _ = rest.posterior(state.columns, state.prior_sigma)
        value = np.zeros(self.dictionary.width)
        first = 0
        for group in self.dictionary.always:
            own = slice(first, first := first + len(group.columns))
            if group.random:  # it says nothing of another position
                mean[own] = 0.0
        np.add.at(value, state.columns, mean)
        return value, np.sqrt(
            np.bincount(state.columns, state.prior_sigma**2, len(value))
        )


def refit(keys: Iterable[str], free: tuple[int, ...] = (), seed: int = 0) -> Refit:
    """Random rows, with all sizes given, about a state with values of its own."""
    # gravity is as little known as where nobody says the place
    x, rng = ladder(3, free, gravity_sigma=0.015), np.random.default_rng(seed)
    d = dictionary(x, common=2e-4)
    d.always = [replace(g, fixed_size=0.3) for g in d.always]
    d.typical_instability = np.zeros(7)
    causes = {c.key: c for c in d.causes}
    members = []
    for key in keys:
        group = replace(causes[key].variants[0], fixed_size=0.5)
        members.append((_with(causes[key], group), group))
    state = nominal()
    y = state.output(x, d.since) + rng.normal(0, 3e-3, (ROWS, 6))
    y += rng.normal(0, 1e-2, (len(LADDER), 6))[x.position]
    rows = rows_of(x, y)
    rows.sd[:] *= rng.uniform(0.5, 2.0, rows.sd.shape)
    values = np.zeros(d.width)
    values[d.bias : d.bias + 3] = rng.normal(0, 1e-2, 3)
    values[d.small_rotation : d.small_rotation + 2 * d.position_count] = rng.normal(
        0, 1e-3, 2 * d.position_count
    )
    linear = WindowSystem(rows, d).linearised(state)
    sets = Sets(d, gram(linear, d, values))
    fitted = FittedSet(rows, d, linear, values, sets.evaluate(tuple(members)))
    table = np.zeros((ROWS, 6, d.width))
    for part in linear:
        seen = part.design / part.weight[:, None]
        table[part.rows[:, None], part.channel, part.columns] = seen
    at, channel = (i.ravel() for i in np.indices((ROWS, 6)))
    design, sd = table.reshape(ROWS * 6, -1), rows.sd.ravel()
    window = x.position[at]
    cov = np.diag(sd**2) + shared(window, channel, d.window_error[window, channel])
    for p in free:
        turns = priors.SMALL_ROTATION * design[:, d.small_rotation + 2 * p :][:, :2]
        cov += turns @ turns.T
    off = y - state.output(x, d.since)
    return Refit(fitted, Dense(off.ravel() + design @ values, design, cov, sd), off)


def _with(cause: Cause, group: Group) -> Cause:
    return replace(cause, variants=(group, *cause.variants[1:]))


def assert_agree(found: Array, expected: Array) -> None:
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-9)


SETS = pytest.mark.parametrize(
    "keys", [(), ("cross_coupling", "settling:acc"), ("random_walk:gyr",)], ids=str
)


@SETS
def test_residuals_are_those_of_a_refit_without_the_position(
    keys: tuple[str, ...],
) -> None:
    one = refit(keys)
    found = held_out_residuals(one.fitted, [one.fitted.set])
    for p in range(len(LADDER)):
        left = one.dictionary.x.position == p
        value, _ = one.without(left)
        at = one.dictionary.small_rotation + 2 * p + np.arange(2)
        value[at] = one.fitted.values[at]
        expected = one.dense.y - one.dense.design @ value
        assert_agree(found[left], expected.reshape(ROWS, 6)[left])


@SETS
def test_how_likely_each_position_is_given_the_others(keys: tuple[str, ...]) -> None:
    one, expected = refit(keys), 0.0
    state = one.fitted.set.state
    for p in range(len(LADDER)):
        kept = np.repeat(one.dictionary.x.position != p, 6)
        rest = Dense(
            one.dense.y[kept], one.dense.design[kept],
            one.dense.cov[np.ix_(kept, kept)], one.dense.white[kept],
        )  # fmt: skip
        expected += one.dense.evidence(state.columns, state.prior_sigma)
        expected -= rest.evidence(state.columns, state.prior_sigma)
    found = HeldOut(one.fitted, [one.fitted.set]).density(one.fitted.set)
    assert found == pytest.approx(expected, rel=1e-8)


def test_squares_of_what_is_predicted_count_what_the_prediction_does_not_know() -> None:
    one, expected = refit(("cross_coupling",)), 0.0
    state, dense = one.fitted.set.state, one.dense
    total = dense.total(state.columns, state.prior_sigma)
    for p in range(len(LADDER)):
        left = np.repeat(one.dictionary.x.position == p, 6)
        across = total[np.ix_(left, ~left)]
        told = np.linalg.solve(total[np.ix_(~left, ~left)], across.T)
        off = dense.y[left] - told.T @ dense.y[~left]
        cov = total[np.ix_(left, left)] - across @ told
        expected += float(off @ np.linalg.solve(cov, off))
    found, count = HeldOut(one.fitted, [one.fitted.set]).squares(one.fitted.set)
    assert found == pytest.approx(expected, rel=1e-6) and count == 6 * ROWS


@pytest.mark.parametrize("free", [(), (3, 4)], ids=["misset", "loose"])
def test_a_positions_own_angles_are_sought_in_it(free: tuple[int, ...]) -> None:
    """Those it was set at, or those that nobody knows; nothing else is."""
    one = refit(() if free else ("misset 4",), free)
    d, found = one.dictionary, held_out_residuals(one.fitted, [one.fitted.set])
    for p in range(len(LADDER)):
        left = d.x.position == p
        value, sizes = one.without(left)
        at = d.small_rotation + 2 * p + np.arange(2)
        value[at] = one.fitted.values[at]  # from where the state has them
        rest, white = one.dense.y - one.dense.design @ value, one.dense.white
        inside = np.repeat(left, 6)
        wide = np.full(2, priors.SMALL_ROTATION) if p in free else sizes[at]
        own = Dense(
            rest[inside], one.dense.design[inside],
            np.diag(white[inside] ** 2), white[inside],
        )  # fmt: skip
        if wide.any():
            turned, _ = own.posterior(at, wide)
            rest = rest - one.dense.design[:, at] @ turned
        assert_agree(found[left], rest.reshape(ROWS, 6)[left])


def test_sets_are_chosen_again() -> None:
    """That a position was misset is nothing that the others show."""
    x, rng = ladder(3), np.random.default_rng(2)
    d, state = dictionary(x), nominal()
    away = replace(state, small_rotation=state.small_rotation.copy())
    away.small_rotation[4] = 0.02, 0.03
    y = away.output(away.experienced(x), d.since)
    rows = rows_of(x, y + rng.normal(0, 3e-4, y.shape))
    linear = WindowSystem(rows, d).linearised(state)
    sets = Sets(d, gram(linear, d, np.zeros(d.width)))
    misset = next(c for c in d.causes if c.key == "misset 4")
    tried = [sets.evaluate(m) for m in ((), ((misset, misset.variants[0]),))]
    assert tried[1].score > tried[0].score + 100
    best = FittedSet(rows, d, linear, np.zeros(d.width), tried[1])
    found = held_out_residuals(best, tried)
    none, there = (held_out_residuals(best, [one]) for one in tried)
    left = x.position == 4
    np.testing.assert_allclose(found[left], none[left], rtol=1e-9)
    np.testing.assert_allclose(found[~left], there[~left], rtol=1e-9)
    assert np.abs(found[left, :3]).max() > 0.1 > 10 * np.abs(found[~left, :3]).max()


def test_each_position_is_left_out_once() -> None:
    d = dictionary(ladder(2))
    fold = folds(d)
    assert len(np.unique(fold)) == len(LADDER)
    np.testing.assert_array_equal(fold, d.x.position)


@pytest.mark.parametrize("free", [(), (3, 4)], ids=["set", "loose"])
def test_residuals_of_what_is_fitted_are_those_of_a_dense_fit(
    free: tuple[int, ...],
) -> None:
    """Turns that nobody knows are those that fit each position best."""
    one = refit(("cross_coupling",), free)
    d, state = one.dictionary, one.fitted.set.state
    mean, _ = one.dense.posterior(state.columns, state.prior_sigma)
    value = np.zeros(d.width)
    np.add.at(value, state.columns, mean)
    wide = one.dense.design[:, state.columns] * state.prior_sigma
    total = one.dense.cov + wide @ wide.T
    back = np.linalg.solve(total, one.dense.y)
    for p in free:
        at = d.small_rotation + 2 * p + np.arange(2)
        value[at] += priors.SMALL_ROTATION**2 * one.dense.design[:, at].T @ back
    # rotations of up to a radian, by rows that are known a million times better, leave
    # six digits of what is fitted to them
    np.testing.assert_allclose(
        estimates_by_column(state, d), value, rtol=1e-5, atol=1e-8
    )
    rest = (one.dense.y - one.dense.design @ value).reshape(ROWS, 6)
    np.testing.assert_allclose(one.fitted.residual(), rest, rtol=1e-5, atol=1e-8)


def test_squares_are_those_of_the_covariance() -> None:
    """Of each channel by itself, with what its windows share."""
    one = refit(("cross_coupling",))
    rest, squares = one.fitted.residual(), one.fitted.squares
    for c in range(6):
        at = np.arange(c, ROWS * 6, 6)
        cov = one.dense.cov[np.ix_(at, at)]
        expected = rest[:, c] @ np.linalg.solve(cov, rest[:, c])
        assert squares[c] == pytest.approx(expected, rel=1e-9)


def test_where_nothing_turned_no_turn_is_foretold() -> None:
    assert held_out_turn_residuals(refit(()).fitted, []).shape == (0,)


def test_sets_that_are_compared_are_the_best_and_the_likeliest_beside_it() -> None:
    """Six within twelve of it, each once, and the empty set however unlikely."""

    @dataclass(eq=False)
    class Scored:
        score: float
        members: tuple[None, ...]

    def one(score: float, members: int = 1) -> Set:
        return cast(Set, Scored(score, (None,) * members))

    best, empty, far = one(10.0), one(-500.0, 0), one(-2.1)
    near = [one(10.0 - 2.8 * k) for k in (3, 1, 2, 4)]
    found = candidate_sets(best, [far, empty, *near, best])
    ranked = [near[1], near[2], near[0], near[3]]
    assert found == [best, *ranked, empty]
    many = [one(9.0 - k) for k in range(9)]
    assert candidate_sets(best, [*many[::-1], empty]) == [best, *many[:6], empty]
    assert candidate_sets(empty, [empty]) == [empty]


def test_estimates_of_random_groups_are_told_apart_by_their_place() -> None:
    """Of permanent groups in their order; columns of two of them add up."""
    columns = ((0, 1), (4, 2), (3,), (2, 1))
    groups = [SimpleNamespace(columns=np.array(at), random=k % 2 == 1)
              for k, at in enumerate(columns)]  # fmt: skip
    d = cast(Dictionary, SimpleNamespace(width=6, always=groups))
    state = SimpleNamespace(estimate=np.arange(1.0, 10.0))
    found = held_out._random_estimate(cast(Set, SimpleNamespace(state=state)), d)
    np.testing.assert_array_equal(found, [0.0, 7.0, 4.0 + 6.0, 0.0, 3.0, 0.0])


def test_of_few_windows_each_stretch_is_foretold_from_the_others() -> None:
    """Stretches of neighbouring rows, as even as they come; of many, whole windows."""
    x = select_rows(ladder(55), range(110))
    few = SimpleNamespace(x=x, window_positions=np.array([0, 1]))
    found = folds(cast(Dictionary, few))
    parts = resolutions.STRETCHES_PER_WINDOW
    for p in range(2):
        own = found[x.position == p]
        assert np.count_nonzero(np.diff(own)) == parts - 1
        first = [0, *(np.flatnonzero(np.diff(own)) + 1)]
        assert own[first].tolist() == [i % tolerances.MAX_FOLDS for i in range(parts)]
        lengths = np.diff([*first, len(own)])
        assert lengths.max() - lengths.min() <= 1
    whole = folds(dictionary(ladder(3)))
    np.testing.assert_array_equal(whole, ladder(3).position % tolerances.MAX_FOLDS)
