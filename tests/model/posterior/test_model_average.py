"""Numbers over all sets that count: by drawing, and as near as they say."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from small_sessions import Session, ladder

from fieldcal.core.samples import Array
from fieldcal.model import priors, thresholds
from fieldcal.model.evidence.eliminated import Eliminated
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.unfitted_groups import eliminate_with, groups_not_in
from fieldcal.model.posterior.model_average import (
    ModelAverage,
    average_of_columns,
    average_over_sets,
    average_over_sizes,
)
from fieldcal.model.posterior.probabilities import Posterior
from fieldcal.model.search.selection import Search
from fieldcal.model.search.variations import visit_variations

SESSION = Session.of(ladder(), ("quadratic", "scale_asymmetry"), 1.0)
QUADRATIC, ASYMMETRY = SESSION.dictionary.causes
BIAS = SESSION.dictionary.always[0].columns
DENSITY = priors.density()


def search_of(value: Array, seed: int) -> Search:
    """Over rows that some values of the quadratic factors made."""
    columns = QUADRATIC.variants[0].columns
    off = SESSION.noise(np.random.default_rng(seed))
    return SESSION.search(off + SESSION.design[:, :, columns] @ value)


def average_of(search: Search) -> tuple[ModelAverage, Set]:
    best = search.run()
    return ModelAverage(
        Posterior(search, best), [average_over_sizes(search.sets, best)]
    ), best


def test_averages_are_those_of_draws_from_the_sets() -> None:
    """A quantity that a set has twice is the sum there, one that it lacks is 0."""
    search, rng = search_of(np.array([3e-5, 0.0, 1e-5]), 1), np.random.default_rng(2)
    one = search.sets.evaluate(((QUADRATIC, QUADRATIC.variants[0]),))
    two = search.sets.evaluate(((ASYMMETRY, ASYMMETRY.variants[0]),))
    sets = [(one, 0.3), (two, 0.1)]
    first, last = one.state.columns[0], one.state.columns[-1]
    mean, cov = average_over_sets(
        sets,
        lambda s: np.array([np.isin(s.state.columns, [first, last]),
                            s.state.columns == last], dtype=float),
    )  # fmt: skip
    drawn = []
    for there, count in ((one, 90_000), (two, 30_000)):
        state = there.state
        full = rng.standard_normal((count, len(state.columns))) @ state.half
        full += state.estimate
        has = [full[:, state.columns == c].sum(axis=1) for c in (first, last)]
        drawn.append(np.column_stack([has[0] + has[1], has[1]]))
    every = np.concatenate(drawn)
    sd = every.std(axis=0)
    np.testing.assert_allclose((mean - every.mean(axis=0)) / sd, 0.0, atol=0.02)
    np.testing.assert_allclose(cov / np.outer(sd, sd), np.cov(every.T, ddof=0)
                               / np.outer(sd, sd), atol=0.03)  # fmt: skip


def test_what_a_set_was_not_given_makes_its_numbers_uncertain() -> None:
    """Of the three quadratic factors one is small: the bias beside it is uncertain."""
    average, best = average_of(search_of(np.array([6e-5, 2e-6, -6e-5]), 5))
    ((_, group),) = best.members
    assert 1 not in group.params
    own = average_of_columns([(average.best[0], 1.0)], BIAS)[1]
    whole = average_of_columns(average.sets, BIAS)[1]
    assert whole[1, 1] > 2.0 * own[1, 1]


def test_what_is_in_no_set_counts_as_if_it_were() -> None:
    """As all of it in one: by the rows that it was drawn in, and so by its pulls."""
    (cause, group), rng = (QUADRATIC, QUADRATIC.variants[0]), np.random.default_rng(9)
    told = np.append(BIAS, group.columns)
    left = ASYMMETRY.variants[0]
    left = replace(left, part=ASYMMETRY.name, typical=np.full(len(left.columns), 2e-3))
    off = SESSION.noise(rng) + SESSION.design[:, :, group.columns] @ np.full(3, 1e-5)
    first = SESSION.search(off).sets.evaluate(((cause, group),))
    columns, sizes = first.state.columns, first.state.prior_sigma
    at = [int(np.flatnonzero(columns == c)[0]) for c in told]
    steady, pulls = (0,) * len(first.sizes.instability), []
    for _ in range(200):
        drawn, more = (s * rng.standard_normal(len(s)) for s in (sizes, left.typical))
        off = SESSION.noise(rng) + SESSION.design[:, :, columns] @ drawn
        off += SESSION.design[:, :, left.columns] @ more
        rows = SESSION.search(off).sets.gram_at(steady)
        there = replace(first, state=Eliminated.of(rows, columns, sizes))
        mean, cov = average_of_columns([(there, 1.0)], told, [left])
        wrong = mean - drawn[at]
        pulls.append(wrong @ np.linalg.solve(cov, wrong) / len(told))
    assert np.mean(pulls) == pytest.approx(1.0, abs=0.15)
    whole = Eliminated.of(
        there.state.rows,
        np.concatenate([columns, left.columns]),
        np.concatenate([sizes, left.typical]),
    )
    np.testing.assert_allclose(mean, whole.estimate[at], rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(cov, whole.inverse[np.ix_(at, at)], rtol=1e-6)
    plain = average_of_columns([(there, 1.0)], told)[1]
    ratio = np.diag(cov) / np.diag(plain)
    assert ratio.max() > 1.5
    # a set that has it knows it
    has = SESSION.search(off).sets.evaluate(((ASYMMETRY, ASYMMETRY.variants[0]),))
    known = average_of_columns([(has, 1.0)], told, [left])[1]
    np.testing.assert_array_equal(known, average_of_columns([(has, 1.0)], told)[1])


def test_what_is_in_no_set_is_eliminated_beside_it() -> None:
    """Once, with its own prior; the evidence is that of the whole."""
    group = QUADRATIC.variants[0]
    left = ASYMMETRY.variants[0]
    left = replace(left, part=ASYMMETRY.name, typical=np.full(len(left.columns), 2e-3))
    off = SESSION.noise(np.random.default_rng(9))
    search = SESSION.search(off)
    lacks = search.sets.evaluate(((QUADRATIC, group),))
    has = search.sets.evaluate(((ASYMMETRY, ASYMMETRY.variants[0]),))
    whole = eliminate_with(lacks, groups_not_in(lacks, [left]))
    columns = np.concatenate([lacks.state.columns, left.columns])
    np.testing.assert_array_equal(whole.columns, columns)
    wide = np.concatenate([lacks.state.prior_sigma, left.typical])
    rows = lacks.state.rows
    inner = rows.matrix(columns, columns) + np.diag(wide**-2.0)
    np.testing.assert_allclose(whole.inverse, np.linalg.inv(inner), 1e-6, 1e-20)
    expected = np.linalg.solve(inner, rows.rhs(columns))
    np.testing.assert_allclose(whole.estimate, expected, rtol=1e-6, atol=1e-12)
    same = eliminate_with(has, groups_not_in(has, [left]))
    np.testing.assert_array_equal(same.columns, has.state.columns)


def test_numbers_of_columns_are_those_of_all_sets_with_what_they_lack() -> None:
    average, _ = average_of(search_of(np.array([3e-5, 0.0, 1e-5]), 1))
    group = ASYMMETRY.variants[0]
    left = replace(group, part=ASYMMETRY.name, typical=np.full(3, 2e-3))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(average.posterior.sets.dictionary, "unfitted", (left,))
        mean, cov = average.average_of_columns(BIAS)
    expected, spread = average_of_columns(average.sets, BIAS, [left])
    np.testing.assert_allclose(mean, expected)
    np.testing.assert_allclose(cov, spread)
    plain = average_of_columns(average.sets, BIAS)[1]
    assert (np.diag(spread) / np.diag(plain)).max() > 1.1


def test_numbers_of_a_member_are_those_of_the_sets_that_have_it() -> None:
    search = search_of(np.array([3e-5, 2e-5, -3e-5]), 7)
    average, best = average_of(search)
    ((cause, group),) = best.members
    there = [(s, w) for s, w in average.sets if cause.key in s.keys]
    mean, cov = average.average_of_member((cause, group))
    total = sum(w for _, w in there)
    by_hand = np.zeros(len(group.params))
    for one, w in there:
        (own,) = (g for c, g in one.members if c is cause)
        for i, param in enumerate(group.params):
            if param in own.params:
                at = one.state.columns == own.columns[own.params.index(param)]
                by_hand[i] += w / total * one.state.estimate[at].sum()
    np.testing.assert_allclose(mean, by_hand)
    assert (np.diag(cov) > 0).all()


def test_where_axes_may_be_turned_other_parameters_are_the_same_device(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Else a number would be the mean of itself and of 0, in other axes."""
    search = search_of(np.array([3e-5, 2e-5, -3e-5]), 7)
    average, _ = average_of(search)
    by = {group.params: group for group in QUADRATIC.variants}
    first, last = (
        search.sets.evaluate(((QUADRATIC, by[p]),)) for p in ((0, 1), (1, 2))
    )
    monkeypatch.setitem(vars(average), "sets", [(first, 0.6), (last, 0.4)])
    member = QUADRATIC, by[0, 1]
    at = [np.flatnonzero(first.state.columns == c)[-1] for c in by[0, 1].columns]
    own = first.state.estimate[at]
    assert average.average_of_member(member)[0][0] == pytest.approx(0.6 * own[0])
    free = np.ones_like(search.sets.dictionary.unoriented)
    monkeypatch.setattr(search.sets.dictionary, "unoriented", free)
    np.testing.assert_allclose(average.average_of_member(member)[0], own)


def test_only_sets_count_that_are_likely_beside_the_best() -> None:
    search = search_of(np.array([1e-4, 1e-4, -1e-4]), 9)
    average, _ = average_of(search)
    top = max(w for _, w in average.posterior.weights_on_grid)
    weights = [w for _, w in average.sets]
    assert min(weights) > np.exp(-thresholds.AVERAGED_LOG_DISTANCE) * top
    kept = [
        w
        for _, w in average.posterior.weights_on_grid
        if w > np.exp(-thresholds.AVERAGED_LOG_DISTANCE) * top
    ]
    assert sorted(weights) == sorted(kept)


@cache
def pulls() -> tuple[Array, Array]:
    """Of the biases by the average and by the best set alone, (n, 3).

    Values are drawn from the prior: all of the parameters, or some, of one effect, at
    sizes at which it shows.
    """
    rng = np.random.default_rng(22)
    mean: list[Array] = []
    alone: list[Array] = []
    shown = priors.SIZES[(priors.SIZES > 0.02) & (priors.SIZES < 0.3)]
    design, noise = SESSION.design, SESSION.dictionary.always
    for _ in range(32):
        cause = (QUADRATIC, ASYMMETRY)[int(rng.integers(2))]
        group = cause.variants[int(rng.integers(len(cause.variants)))]
        off = SESSION.noise(rng)
        size = group.prior_sigma(float(rng.choice(shown)))
        off += design[:, :, group.columns] @ (size * rng.standard_normal(len(size)))
        true = 0.1 * noise[0].typical * rng.standard_normal(3)
        off += design[:, :, BIAS] @ true
        average, best = average_of(SESSION.search(off))
        for out, sets in ((mean, average.sets), (alone, [(average.best[0], 1.0)])):
            value, cov = average_of_columns(sets, BIAS)
            out.append((value - true) / np.sqrt(np.diag(cov)))
    return np.array(mean), np.array(alone)


@pytest.mark.thorough
def test_biases_are_as_near_as_they_say_whatever_was_chosen() -> None:
    mean, alone = pulls()
    assert np.mean(np.abs(mean) < 1.96) > 0.9
    rms, other = (float(np.sqrt((some**2).mean())) for some in (mean, alone))
    assert 0.8 < rms < 1.25
    assert other > rms + 0.3, "the best set alone is not"


@pytest.mark.parametrize("times", [1.0, 2.0])
def test_variants_that_come_near_are_visited(times: float) -> None:
    """Of the same cause, and no others."""
    search = search_of(np.array([3e-5, 4e-6, -3e-5]) * times, 5)
    best = search.run()
    before = set(search.sets.visited)
    visit_variations(search.sets, best, best.score)
    ((cause, _),) = best.members
    new = [s for key, s in search.sets.visited.items() if key not in before]
    assert {c for s in new for c, _ in s.members} <= {cause}
    every = [search.sets.evaluate(((cause, v),)) for v in cause.variants]
    near = {search.sets.key(s.members) for s in every if s.score > best.score - 2.0}
    assert near <= before | {search.sets.key(s.members) for s in new}
