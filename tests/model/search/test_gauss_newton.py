"""The state that is found, on rows of a device whose errors are known."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from small_sessions import LADDER, SD, Session, dictionary, ladder, nominal, rows_of

from fieldcal.core.samples import Array
from fieldcal.effects import catalogue
from fieldcal.model import priors
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.evidence.eliminated import Eliminated
from fieldcal.model.evidence.sets import Set, Sets
from fieldcal.model.evidence.sizing import Sizes
from fieldcal.model.search.gauss_newton import GaussNewton
from fieldcal.model.search.inference import Inference, InferenceResult, resume
from fieldcal.model.search.offers import Offers, OfferTable
from fieldcal.model.search.pairs import offered_pairs
from fieldcal.model.search.refinement import Refinement
from fieldcal.model.search.selection import Search
from fieldcal.model.state import State, Term
from fieldcal.model.system.window_rows import WindowSystem

X = ladder(4)
EFFECTS = catalogue()
TAU = 7.3
BIAS = np.array([0.02, -0.03, 0.01, 1e-3, -2e-3, 5e-4])
SCALE = np.array([1.002, 0.999, 1.001, 1.0, 1.0, 1.0])


def state_of(*terms: Term, turned: Array | None = None) -> State:
    small = np.zeros((len(LADDER), 2)) if turned is None else turned
    return State(BIAS, SCALE, small, np.zeros(3), terms)


def fit_of(state: State, seed: int = 2) -> GaussNewton:
    """Of rows that a state predicts, with noise."""
    d = dictionary(X)
    y = state.output(state.experienced(X), d.since)
    y += SD * np.random.default_rng(seed).standard_normal(y.shape)
    return GaussNewton(WindowSystem(rows_of(X, y), d), nominal())


SETTLING = Term(
    EFFECTS["settling"], np.array([0.05, -0.03, 0.02, 0, 0, 0]), {"tau_s": TAU}
)


@cache
def settling() -> InferenceResult:
    return Inference(fit_of(state_of(SETTLING))).run()


def chi2(found: InferenceResult) -> float:
    """Weighted squares of what the state leaves, over the rows."""
    system = found.fit.system
    assert isinstance(system, WindowSystem)
    rows, d = system.rows, system.dictionary
    off = rows.y - found.state.output(found.state.experienced(X), d.since)
    return float(np.mean((off / SD) ** 2))


def test_a_time_constant_is_found_between_the_points_of_its_grid() -> None:
    found = settling()
    ((cause, group),) = found.best.members
    assert cause.key == "settling:acc"
    unsure = group.shape_sigma("tau_s")
    assert 0.0 < unsure < 0.05 * TAU
    assert abs(group.shape["tau_s"] - TAU) < 4 * unsure
    (term,) = found.state.terms
    assert term.shape == group.shape and term.effect is EFFECTS["settling"]
    sigma = np.sqrt(np.diag(found.best.state.inverse))
    at = [found.best.state.columns.tolist().index(c) for c in group.columns]
    off = term.values[list(group.params)] - SETTLING.values[list(group.params)]
    assert (np.abs(off) < 6 * sigma[at] + 1e-3).all()
    assert chi2(found) == pytest.approx(1.0, abs=0.2)


def test_what_a_part_told_is_begun_with_and_what_it_told_wrongly_is_dropped(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Its members are of another dictionary; nothing else is begun with."""
    told = settling()
    causes = {c.key: c for c in told.fit.dictionary.causes}
    wrong = (causes["cubic"], causes["cubic"].variants[0])
    fit = fit_of(state_of(SETTLING))
    monkeypatch.setattr(Inference, "_search_from_nominal", None)
    found = Inference(fit).run((*told.best.members, wrong))
    assert found.best.keys == {"settling:acc"}
    (group,) = (g for _, g in found.best.members)
    assert group.shape["tau_s"] == pytest.approx(TAU, rel=0.05)


def test_a_set_that_is_held_is_not_searched_beside(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Its members are of another dictionary; the state is that with them alone."""
    told, fit = settling(), fit_of(state_of(SETTLING))
    monkeypatch.setattr(Search, "run", None)
    found = Inference(fit).hold(told.best.members)
    ((cause, group),) = found.best.members
    assert cause.key == "settling:acc" and cause in fit.dictionary.causes
    (term,) = found.state.terms
    assert term.effect is EFFECTS["settling"] and term.shape == group.shape
    assert found.visited_keys == frozenset() and found.fit is fit
    assert len(found.values) == fit.dictionary.width
    own = term.values[list(group.params)]
    np.testing.assert_allclose(own, found.values[group.columns], atol=1e-12)
    assert found.turn_rows == [] and found.contradicted_turns == ()
    # on the grid the time constant is not quite what it was refined to
    assert chi2(found) == pytest.approx(1.0, abs=0.3)
    nothing = Inference(fit_of(state_of(SETTLING))).hold(())
    assert nothing.best.members == () and nothing.state.terms == ()
    assert chi2(nothing) > 10


def test_a_better_set_is_gone_on_from_until_one_comes_again() -> None:
    told = settling()
    fit = fit_of(state_of(SETTLING))
    start = Inference(fit).hold(())
    found = resume(start.best, start)
    assert found.best.keys == told.best.keys
    assert chi2(found) == pytest.approx(1.0, abs=0.2)
    (_, group), (_, other) = (r.best.members[0] for r in (found, told))
    assert group.shape["tau_s"] == pytest.approx(other.shape["tau_s"], rel=0.02)
    assert Sets.key(start.best.members) in found.visited_keys


def test_what_is_gone_on_from_keeps_its_columns() -> None:
    """If nothing better comes of it, it can still be asked which causes it lacks."""
    start = Inference(fit_of(state_of(SETTLING))).hold(())
    offered = [o.member[0].key for o in start.search.offers.ranked(start.best)]
    width = start.fit.dictionary.width
    found = resume(start.best, start)
    assert found.fit.dictionary.width > width == start.fit.dictionary.width
    again = Offers(start.search.sets).ranked(start.best)
    assert [o.member[0].key for o in again] == offered


def test_the_state_is_what_the_columns_say() -> None:
    found, d = settling(), settling().fit.dictionary
    values = found.values
    np.testing.assert_allclose(found.state.bias, values[d.bias : d.bias + 6])
    np.testing.assert_allclose(found.state.scale, 1 + values[d.scale : d.scale + 6])
    np.testing.assert_allclose(found.state.earth, values[d.earth : d.earth + 3])
    np.testing.assert_allclose(found.state.bias, BIAS, atol=1e-3)
    assert not found.state.small_rotation.any()
    assert len(values) == d.width
    kept = {int(c) for g in d.always for c in g.columns}
    kept |= {int(c) for _, g in found.best.members for c in g.columns}
    assert set(np.flatnonzero(values)) <= kept


def test_a_nominal_state_is_started_from_and_kept() -> None:
    """What a simulation has already is not found once more."""
    plain = fit_of(state_of(SETTLING))
    near = SCALE + [0.01, -0.006, 0.003, 0.0, 0.0, 0.0]
    start = State(BIAS + 0.01, near, np.zeros((9, 2)), np.zeros(3), (SETTLING,))
    plain.nominal = start
    found = Inference(plain).run()
    assert found.best.members == ()
    (term,) = found.state.terms
    assert term.effect is SETTLING.effect and term.shape == SETTLING.shape
    np.testing.assert_array_equal(term.values, SETTLING.values)
    np.testing.assert_allclose(found.state.bias, BIAS, atol=1e-3)
    np.testing.assert_allclose(found.state.scale[:3], SCALE[:3], atol=1e-3)
    assert chi2(found) == pytest.approx(1.0, abs=0.2)


def test_a_position_far_from_where_it_is_said_to_be_is_followed() -> None:
    turned = np.zeros((len(LADDER), 2))
    turned[4] = np.deg2rad([9.0, -4.0])
    found = Inference(fit_of(state_of(turned=turned))).run()
    ((cause, group),) = found.best.members
    assert (cause.name, group.position) == ("misset", 4)
    np.testing.assert_allclose(found.state.small_rotation, turned, atol=2e-4)
    assert chi2(found) == pytest.approx(1.0, abs=0.2)


def test_where_nothing_is_the_state_is_bias_and_scale_factor() -> None:
    found = Inference(fit_of(state_of())).run()
    assert found.best.members == () and found.state.terms == ()
    np.testing.assert_allclose(found.state.bias, BIAS, atol=1e-3)
    assert chi2(found) == pytest.approx(1.0, abs=0.2)


def test_another_set_is_refined_beside_and_leaves_no_columns() -> None:
    """Its evidence is no less than that at the best point of the grid."""
    found = settling()
    d = found.fit.dictionary
    cause = next(c for c in d.causes if c.key == "settling:gyr")
    whole = [g for g in cause.variants if len(g.columns) == 3]
    (own,) = found.best.members
    on_grid = [found.search.sets.evaluate((own, (cause, g))).score for g in whole]
    best = whole[int(np.argmax(on_grid))]
    there = found.search.sets.evaluate((own, (cause, best)))
    width, count = d.width, len(d.bases)
    refined = found.with_refined_shapes(there)
    assert (d.width, len(d.bases)) == (width, count)
    assert refined.members[0][1] is own[1], "what was found stays"
    assert refined.members[1][1].shape != best.shape
    assert refined.members[1][1].params == best.params
    more = len(refined.members[1][0].variants) / len(cause.variants)
    assert refined.score >= max(on_grid) - np.log(more) - 0.1


def test_a_settled_state_stays() -> None:
    """About it the estimate is the state itself, column by column."""
    found = settling()
    d = found.fit.dictionary
    members = found.best.members
    state, values, again = found.fit.settle(found.state, found.values, members)
    sigma = np.sqrt(np.diag(again.state.inverse))
    linear = [c for g in d.always for c in g.columns]
    at = np.isin(again.state.columns, linear)
    off = (values - found.values)[again.state.columns]
    assert (np.abs(off) < 0.1 * sigma)[at].all()
    np.testing.assert_allclose(state.bias, found.state.bias, atol=1e-4)


def test_a_set_is_settled_one_step_from_where_its_rows_were_linearised() -> None:
    fit, members = settling().fit, settling().best.members
    zeros = np.zeros(fit.dictionary.width)
    state, values, about = fit.approach(nominal(), zeros, members)
    again, _ = fit.estimate(state, values, members, about.sizes)
    np.testing.assert_allclose(again.state.estimate, about.state.estimate, atol=1e-9)
    _, settled, same = fit.settle(nominal(), zeros, members)
    np.testing.assert_array_equal(same.state.estimate, about.state.estimate)
    np.testing.assert_array_equal(settled, fit.state_at_estimate(about)[1])
    assert 0 < fit.largest_step(about, values, settled) < 0.03


def test_wanted_are_columns_of_the_set_and_what_is_always_there() -> None:
    found, d = settling(), settling().fit.dictionary
    wanted = found.fit.wanted_columns(found.best.members)
    groups = [*d.always, *(g for _, g in found.best.members)]
    expected = sorted({int(c) for g in groups for c in g.columns})
    assert np.flatnonzero(wanted).tolist() == expected
    free = GaussNewton(WindowSystem(rows_of(X, X.f @ np.zeros((3, 6))),
                              dictionary(ladder(6, (2,)))), nominal())  # fmt: skip
    own = free.dictionary
    some = free.wanted_columns(())
    assert some[own.small_rotation : own.small_rotation + 18].all()


def test_what_begins_at_a_refined_instant_may_be_of_any_kind() -> None:
    """A jump of a bias in the last position is a knock at the base too, as exactly."""
    x = ladder(6)
    d = dictionary(x)
    cause = next(c for c in d.causes if c.key == "bias_step:acc")
    here = next(g for g in cause.variants if g.params == (1,))
    later = x.t > x.t[x.position == 8].mean()
    y = np.hstack([x.f, x.w])
    y[later, 1] += 0.03
    fit = GaussNewton(WindowSystem(rows_of(x, y), d), nominal())
    none = np.zeros(d.width)
    _, _, found = fit.settle(nominal(), none, ((cause, here),))
    refinement = Refinement(fit, nominal(), none, found.sizes)
    ((_, refined),) = refinement.refine_shapes(((cause, here),))
    at = refined.shape["at_s"]
    assert at not in {g.shape["at_s"] for g in cause.variants}
    for key in ("bias_step:gyr", "base_step", "mount_slip"):
        other = next(c for c in d.causes if c.key == key)
        then = {g.params for g in other.variants if g.shape["at_s"] == at}
        assert then == {g.params for g in other.variants}, key


def shared_step(
    seed: int,
) -> tuple[Refinement, tuple[tuple[Cause, Group], ...], float]:
    """Both triads jump at one instant; a set has the jumps at two others."""
    x = ladder(6)
    d = dictionary(x)
    rows = np.flatnonzero(x.position == 6)
    instant = float(x.t[rows[2:4]].mean())
    later = (x.t > instant)[:, None]
    y = np.hstack([x.f, x.w]) + later * np.r_[0.0, 0.03, 0.0, 0.0, 0.0, 2e-3]
    y += SD * np.random.default_rng(seed).standard_normal(y.shape)
    fit = GaussNewton(WindowSystem(rows_of(x, y), d), nominal())
    members = []
    for key, param, off in (("bias_step:acc", 1, -60.0), ("bias_step:gyr", 5, 50.0)):
        cause = next(c for c in d.causes if c.key == key)
        near = [g for g in cause.variants if g.params == (param,)]
        at = np.abs([g.shape["at_s"] - instant - off for g in near])
        members.append((cause, near[int(np.argmin(at))]))
    own = tuple(members)
    state, values, found = fit.settle(nominal(), np.zeros(d.width), own)
    return Refinement(fit, state, values, found.sizes), own, instant


def test_members_that_begin_together_are_moved_together() -> None:
    """To the likelier of their instants first, and on from there."""
    refinement, own, instant = shared_step(3)
    begins = {g.shape["at_s"] for _, g in own}
    assert len(begins) == 2 and min(abs(t - instant) for t in begins) > 5
    found = refinement.refine_shape(own, [0, 1])
    (at,) = {g.shape["at_s"] for _, g in found}
    assert [c.key for c, _ in found] == [c.key for c, _ in own]
    assert [g.params for _, g in found] == [(1,), (5,)]
    scores = refinement._scores(
        refinement._trial_sets(
            own, [0, 1], [{"at_s": t} for t in (*sorted(begins), at)]
        )[1:]
    )
    assert scores[2] >= max(scores)
    assert scores[2] > max(scores[:2]) or at in begins
    # of one alone the other stays where it is
    ((_, moved), (_, kept)) = refinement.refine_shape(own, [0])
    assert kept is own[1][1] and moved.params == (1,)
    # a jump has no parabola, and no time constant
    assert all(g.shape_covariance is None for _, g in found)


def test_the_largest_step_is_that_of_the_state_in_its_deviations() -> None:
    """Of bias and scale factor and of effects; not of what the state does not have."""
    found, d = settling(), settling().fit.dictionary
    walk = next(c for c in d.causes if c.key == "random_walk:gyr")
    members = (*found.best.members, (walk, walk.variants[0]))
    beside = found.search.sets.evaluate(members)
    state = beside.state
    sigma = np.sqrt(np.diag(state.inverse))
    kept = [g for g in [*d.always, *(g for _, g in members)] if g.in_state]
    inside = np.unique(np.concatenate([g.columns for g in kept]))
    outside = np.setdiff1d(state.columns, inside)
    assert len(outside)
    values = np.zeros(d.width)
    for column, times in ((d.bias + 2, 3.0), (d.scale + 1, -5.0)):
        at = int(np.flatnonzero(state.columns == column)[-1])
        values[column] = times * sigma[at]
        step = found.fit.largest_step(beside, np.zeros(d.width), values)
        assert step == pytest.approx(abs(times))
        back = found.fit.largest_step(beside, values, np.zeros(d.width))
        assert back == pytest.approx(abs(times))
    values[outside] = 1e3
    assert found.fit.largest_step(beside, values * 0, values) == pytest.approx(5.0)


def test_a_position_that_lies_elsewhere_is_turned_in_the_state() -> None:
    """Without angles, by what the set leaves of its force, along its own two axes."""
    x = ladder(6, (2,))
    d = dictionary(x)
    small = np.zeros((len(LADDER), 2))
    small[2] = 4e-4, -7e-4
    true = replace(nominal(), small_rotation=small)
    y = true.output(true.experienced(x), d.since)
    fit = GaussNewton(WindowSystem(rows_of(x, y), d), nominal())
    fitted, _ = fit.estimate(nominal(), np.zeros(d.width), ())
    state, values = fit.state_at_estimate(fitted)
    np.testing.assert_allclose(state.small_rotation[2], small[2], rtol=0.02)
    np.testing.assert_array_equal(values[d.rotations].reshape(-1, 2),
                                  state.small_rotation)  # fmt: skip
    assert not np.delete(state.small_rotation, 2, axis=0).any()


# --- two at a time

KEYS = ("angle_offset", "quadratic", "g_sensitivity", "bias_drift:acc",
        "bias_drift:gyr", "cross_coupling")  # fmt: skip
SESSION = Session.of(ladder(), KEYS)


def drawn(seed: int) -> tuple[Search, Set]:
    """Two causes that are there beside noise."""
    rng = np.random.default_rng(seed)
    causes = {c.key: c for c in SESSION.dictionary.causes}
    off = SESSION.noise(rng)
    for key in ("cross_coupling", "bias_drift:acc"):
        group = causes[key].variants[0]
        some = 0.05 * group.typical * rng.standard_normal(len(group.columns))
        off += SESSION.design[:, :, group.columns] @ some
    search = SESSION.search(off)
    return search, search.sets.evaluate(())


@pytest.mark.parametrize("seed", range(3))
def test_of_all_pairs_the_best_is_taken(seed: int) -> None:
    search, empty = drawn(seed)
    found = search._with_two_more(empty, -np.inf)
    assert len(found.members) == 2
    scores = []
    for table in search.offers.tables(empty):
        for pair in offered_pairs(search.sets, empty, table, -np.inf):
            scores.append(pair.score)
            both = search.offers.accept(empty, pair.first, pair.second)
            assert both.keys == {*pair.keys}
    every = [s for s in search.sets.visited.values() if len(s.members) == 2]
    assert found.score >= max(s.score for s in every) - 0.5
    assert found.score >= max(scores) - 1.0
    assert search._with_two_more(empty, np.inf) is empty, "none comes near"


def test_the_score_of_a_pair_is_that_of_its_sizes() -> None:
    """Evidence, density of both sizes, and the chance of both causes."""
    search, empty = drawn(0)
    density = np.log(priors.density())
    seen = 0
    for table in search.offers.tables(empty):
        before = table.state
        for pair in offered_pairs(search.sets, empty, table, -np.inf):
            columns, sigma = [before.columns], [before.prior_sigma]
            total = -before.score + table.score
            for offer in (pair.first, pair.second):
                group = offer.member[1]
                columns.append(group.columns)
                sigma.append(group.prior_sigma(float(priors.SIZES[offer.size])))
                total += density[offer.size]
            both = Eliminated.of(
                before.rows, np.concatenate(columns), np.concatenate(sigma)
            )
            members = (pair.first.member, pair.second.member)
            chance = search.sets.set_log_prior(members) - search.sets.set_log_prior(())
            assert pair.score == pytest.approx(both.score + total + chance, abs=1e-6)
            seen += pair.first.size != pair.second.size
    assert seen > 5


@pytest.mark.parametrize("seed", range(2))
def test_only_pairs_that_cannot_reach_a_score_are_left_out(seed: int) -> None:
    """Whatever the score of the set itself is, and whatever its sign."""
    search, empty = drawn(seed)
    whole = max(search.offers.tables(empty), key=lambda table: len(table.offers))
    assert len(whole.offers) > 3
    for level in (whole.score, 40.0, -40.0):
        table = replace(whole, score=level)

        def scores(least: float, table: OfferTable = table) -> dict[Any, float]:
            pairs = offered_pairs(search.sets, empty, table, least)
            return {(p.keys, p.first.member, p.second.member): p.score for p in pairs}

        every = scores(-np.inf)
        least = float(np.median([*every.values()]))
        kept = scores(least)
        assert {k for k, s in every.items() if s >= least} <= set(kept)
        assert all(every[k] == pytest.approx(s) for k, s in kept.items())
        assert len(kept) < len(every)
        assert not scores(max(every.values()) + 50.0)


class Watched(Search):
    """A search that notes beside which sets pairs were tried."""

    def _with_two_more(
        self, there: Set, level: float | None = None, other_sizes: Sizes | None = None
    ) -> Set:
        """Note the set, and go on as ever."""
        self.__dict__.setdefault("asked", []).append(there)
        return super()._with_two_more(there, level, other_sizes)


@pytest.mark.parametrize("seed", range(2))
def test_what_costs_much_is_tried_where_nothing_cheap_helps(seed: int) -> None:
    """And by a thorough search alone."""
    one, _ = drawn(seed)
    quick, whole = (Watched(Sets(one.sets.dictionary, one.sets.gram)) for _ in range(2))
    best = quick.run(thorough=False)
    assert "asked" not in quick.__dict__
    assert quick._step(best, [quick._with_one_more, quick._with_one_replaced]) is best
    found = whole.run()
    assert found.score >= best.score
    first = whole.__dict__["asked"][0]
    assert Sets.key(first.members) == Sets.key(best.members)


def part_of(whole: Group, count: int) -> Group:
    return replace(
        whole, params=whole.params[:count], columns=whole.columns[:count],
        typical=whole.typical[:count],
    )  # fmt: skip


def test_all_the_parameters_of_a_cause() -> None:
    d: Dictionary = SESSION.dictionary
    cause: Cause = next(c for c in d.causes if c.key == "cross_coupling")
    whole = cause.variants[0]
    assert cause.full_variant(part_of(whole, 2)) is whole
    assert cause.full_variant(whole) is whole
    shaped = replace(part_of(whole, 2), shape={"tau_s": 1.0})
    assert cause.full_variant(shaped) is shaped
    search, empty = drawn(0)
    offer = next(o for o in search.offers.ranked(empty)
                 if o.member[0].key == "cross_coupling")  # fmt: skip
    wide = replace(offer, member=(cause, part_of(whole, 2))).with_all_parameters()
    assert wide.member == (cause, whole)
    assert (wide.size, wide.instability) == (offer.size, offer.instability)
    same = replace(offer, member=(cause, whole))
    assert same.with_all_parameters() is same


def test_a_step_beyond_what_is_linear_ends_on_the_way() -> None:
    """Where rows contradict each other, estimates have no bounds; the state has."""
    fit = fit_of(state_of())
    d = fit.dictionary
    zeros = np.zeros(d.width)
    settled, _ = fit.estimate(nominal(), zeros, ())
    whole = fit.state_at_estimate(settled)[1]
    near, values = fit._step_towards(settled, zeros)
    np.testing.assert_array_equal(values, whole)
    np.testing.assert_array_equal(
        near.bias, nominal().bias + whole[d.bias : d.bias + 6]
    )
    # from a turn of 4 rad it is a quarter of the way, in all columns alike
    far = zeros.copy()
    first = d.rotations.start
    far[first] = whole[first] + 4 * priors.SMALL_ROTATION
    state, values = fit._step_towards(settled, far)
    np.testing.assert_allclose(values, far + (whole - far) / 4, rtol=1e-12, atol=1e-15)
    assert state.small_rotation.flat[0] == pytest.approx(values[first])
    np.testing.assert_allclose(
        state.bias, nominal().bias + values[d.bias : d.bias + 6], rtol=1e-12
    )
    # and so for a parameter, by its typical size
    own = next(c for c in d.causes if c.name == "angle_offset").variants[0].columns[0]
    far = zeros.copy()
    far[own] = 2 * priors.FREE_SIZE * d.typical[own]
    _, values = fit._step_towards(settled, far)
    np.testing.assert_allclose(values, far + (whole - far) / 2, rtol=1e-12, atol=1e-15)
