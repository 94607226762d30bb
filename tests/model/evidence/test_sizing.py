"""Sizes of one set, against scores that are written out size by size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from gram_cases import TAU, case
from small_sessions import Session, ladder

from fieldcal.core.samples import Array
from fieldcal.model import priors, resolutions
from fieldcal.model.evidence.eliminated import Eliminated, gains_from_eigenvalues
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.size_between import (
    most_probable_axis_size,
    most_probable_size,
)
from fieldcal.model.evidence.sizing import (
    LOG_SIZE_STEP,
    UNIT_INDEX,
    instability_log_prior,
)
from fieldcal.model.priors import SIZES
from fieldcal.model.search.set_at_instability import (
    LOWERED_TOGETHER,
    lowered_instability,
    with_typical_calibration,
)

SET = np.array([0, 3, 4, 7])
KEYS = ("angle_offset", "bias_drift:gyr", "alpha:ay")
SESSION = Session.of(ladder(), KEYS)
DENSITY = np.log(priors.density())
UNSTEADY = np.log(priors.density(priors.INSTABILITY_TAIL))


def test_numbers_that_everything_is_compared_with() -> None:
    """Each falls as v to some power, and is even below one."""
    for tail in (4.0, 8.0):
        share = priors.density(tail)
        assert share.sum() == pytest.approx(1.0)
        assert share[:8] == pytest.approx(share[0], rel=1e-4)
        large = np.log(share[-1] / share[-2]) / np.log(SIZES[-1] / SIZES[-2])
        assert large == pytest.approx(-tail, rel=1e-3)
    loose = priors.instability_density_of_given_set()
    assert loose.sum() == pytest.approx(1.0)
    wide = (SIZES > 1) & (SIZES <= 100)
    beside = loose - 0.8 * priors.density(8.0)
    np.testing.assert_allclose(beside[wide], 0.2 / wide.sum())
    np.testing.assert_allclose(beside[~wide], 0.0, atol=1e-15)
    assert SIZES[UNIT_INDEX] == pytest.approx(1.0, rel=0.4)
    np.testing.assert_allclose(np.diff(np.log(SIZES)), LOG_SIZE_STEP)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("v", [0.3, 2.0])
def test_a_size_between_those_tried_is_where_the_evidence_is_highest(
    seed: int, v: float
) -> None:
    """By dense rows; its uncertainty is that of the curvature, or the prior's."""
    one, at = case(seed), np.array([1, 2])
    typical = np.array([0.7, 2.0, 1.0, 0.5])
    state = Eliminated.of(
        one.gram.with_instability(TAU), SET, typical * [1.0, v, v, 1.0]
    )
    best, unsure = most_probable_size(state, at, v)
    fine = v * np.exp(np.linspace(-LOG_SIZE_STEP, LOG_SIZE_STEP, 129))
    score = [one.dense.evidence(SET, typical * [1.0, u, u, 1.0]) for u in fine]
    score += np.interp(np.log(fine), np.log(SIZES), DENSITY)
    assert best == pytest.approx(fine[int(np.argmax(score))], rel=1e-9)
    part = one.dense.design[:, SET[at]] * typical[at]
    rest = one.dense.total(SET[[0, 3]], typical[[0, 3]])
    strength = np.linalg.eigvalsh(part.T @ np.linalg.solve(rest, part))
    share = best**2 * strength / (1 + best**2 * strength)
    assert unsure == pytest.approx(max(2 * (share**2).sum(), 0.1) ** -0.5, rel=1e-6)


def test_a_size_that_rows_say_nothing_of_is_as_uncertain_as_before() -> None:
    one = case(1)
    state = Eliminated.of(one.gram.with_instability(TAU), SET, np.full(4, 1e-6))
    assert most_probable_size(state, np.array([0]), 1e-6)[1] == pytest.approx(0.1**-0.5)


@pytest.mark.parametrize("seed", range(3))
def test_the_size_of_one_axis_of_several_by_dense_rows(seed: int) -> None:
    """Of two columns that have one size in a set, each may have more or less of it."""
    one, v, middle, part = case(seed), 0.8, 1.1, 0.4
    typical = np.array([0.7, 2.0, 1.0, 0.5])
    state = Eliminated.of(
        one.gram.with_instability(TAU), SET, typical * [1.0, v, v, 1.0]
    )
    best, unsure = most_probable_axis_size(state, np.array([2]), v, (middle, part))
    apart = np.linspace(-4.0, 4.0, 129)
    near = middle * np.exp(apart * priors.AXES_LOG_SPREAD)
    score = [one.dense.evidence(SET, typical * [1.0, v, u, 1.0]) for u in near]
    assert best == pytest.approx(near[int(np.argmax(score - apart**2 / 2))])
    column = one.dense.design[:, SET[2]]
    rest = one.dense.total(SET[[0, 1, 3]], typical[[0, 1, 3]] * [1.0, v, 1.0])
    strength = column @ np.linalg.solve(rest, column)
    share = best**2 * strength / (1 + best**2 * strength)
    before = priors.AXES_LOG_SPREAD**-2
    info = before + 2 * share**2
    assert unsure == pytest.approx(np.sqrt(1 / info + (before * part / info) ** 2))


def test_gains_at_sizes_by_hand() -> None:
    """(3) of two directions at two sizes."""
    found = gains_from_eigenvalues(
        np.array([4.0, 0.0]), np.array([9.0, 1.0]), np.array([0.5, 2.0])
    )
    first = 0.5 * (0.25 * 9 / 2 - np.log(2.0)) + 0.5 * 0.25
    second = 0.5 * (4 * 9 / 17 - np.log(17.0)) + 0.5 * 4
    np.testing.assert_allclose(found, [first, second])


def test_how_alike_instabilities_are_by_hand() -> None:
    unstable = np.array([1.0, 1.0, 0.0, 2.0, 0.0, 0.0, 3.0])
    found = instability_log_prior((10, 14, 99, 20, 99, 99, 16), unstable)
    apart = 2 * (2 * LOG_SIZE_STEP / priors.AXES_LOG_SPREAD) ** 2 / 2
    assert found == pytest.approx(UNSTEADY[12] + UNSTEADY[20] + UNSTEADY[16] - apart)
    between = instability_log_prior((10, 11, 0, 20, 0, 0, 16), unstable)
    middle = (UNSTEADY[10] + UNSTEADY[11]) / 2
    apart = 2 * (LOG_SIZE_STEP / 2 / priors.AXES_LOG_SPREAD) ** 2 / 2
    assert between == pytest.approx(middle + UNSTEADY[20] + UNSTEADY[16] - apart)
    other = np.linspace(0.0, -1.0, len(SIZES))
    assert instability_log_prior(
        (10, 14, 0, 20, 0, 0, 16), unstable, other
    ) == pytest.approx(
        other[12]
        + other[20]
        + other[16]
        - 2 * (2 * LOG_SIZE_STEP / priors.AXES_LOG_SPREAD) ** 2 / 2
    )
    assert instability_log_prior((5,) * 7, np.zeros(7)) == 0.0


def found(seed: int) -> tuple[Session, Set]:
    rng = np.random.default_rng(seed)
    tau = SESSION.dictionary.typical_instability * 3.0
    search = SESSION.search(SESSION.noise(rng, tau))
    return SESSION, search.sets.evaluate(())


def profile_of(there: Set, gram_score: Array, kind: int) -> Array:
    """Score of a set over the sizes of one instability, the others as they are."""
    every = np.tile(there.sizes.instability, (len(SIZES), 1))
    every[:, kind] = np.arange(len(SIZES))
    out: Array = gram_score + instability_log_prior(
        every, SESSION.dictionary.typical_instability
    )
    return out


@pytest.mark.parametrize("seed", range(2))
def test_the_weight_of_a_set_is_its_score_and_what_each_size_leaves_of_it(
    seed: int,
) -> None:
    """Every size beside the others, from rows eliminated anew at each."""
    session, there = found(seed)
    d, search = session.dictionary, session.search(np.zeros((27, 6)))
    gram = there.state.rows.gram
    columns, wide = there.state.columns, there.state.prior_sigma
    top = there.state.score + instability_log_prior(
        there.sizes.instability, d.typical_instability
    )
    free = [i for i, g in enumerate(d.always) if g.fixed_size is None]
    top += sum(DENSITY[there.sizes.calibration[i]] for i in free)
    total, starts = top, np.cumsum([0, *(len(g.columns) for g in d.always)])
    rows = gram.with_instability(
        SIZES[list(there.sizes.instability)] * d.typical_instability
    )
    for i in free:
        scores = []
        for k, v in enumerate(SIZES):
            sizes = wide.copy()
            sizes[starts[i] : starts[i + 1]] = d.always[i].prior_sigma(float(v))
            scores.append(Eliminated.of(rows, columns, sizes).score + DENSITY[k])
        own = there.sizes.calibration[i]
        assert int(np.argmax(scores)) == own
        total += np.logaddexp.reduce(np.array(scores) - scores[own])
    for c in range(6):
        score = []
        for v in range(len(SIZES)):
            each = list(there.sizes.instability)
            each[c] = v
            tau = SIZES[each] * d.typical_instability
            score.append(Eliminated.of(gram.with_instability(tau), columns, wide).score)
        profile = profile_of(there, np.array(score), c)
        total += np.logaddexp.reduce(profile - profile.max())
    assert there.score == pytest.approx(total, rel=1e-6)
    assert search.sets.evaluate(()).members == ()


@pytest.mark.parametrize("seed", range(2))
def test_what_a_set_may_be_given_is_asked_beside_other_instabilities(seed: int) -> None:
    """Each table's score is that of the set there, with the prior of it."""
    rng = np.random.default_rng(seed)
    tau = SESSION.dictionary.typical_instability * 3.0
    search = SESSION.search(SESSION.noise(rng, tau))
    there, d = search.sets.evaluate(()), SESSION.dictionary
    tables = search.offers.tables(there)
    mode = there.sizes.instability
    kept = {t.instability for t in tables}
    expected = {
        mode,
        *(
            lowered_instability(mode, some, down)
            for some in LOWERED_TOGETHER
            for down in resolutions.INSTABILITY_STEPS_DOWN
        ),
    }
    assert kept == expected
    rest = (
        there.score
        - there.state.score
        - instability_log_prior(mode, d.typical_instability)
    )
    wide, cost = with_typical_calibration(search.sets.dictionary, there)
    for table in tables:
        if table.instability == mode:
            continue
        scores = []
        for sizes, more in ((there.state.prior_sigma, 0.0), (wide, cost)):
            rows = search.sets.gram.with_instability(
                SIZES[list(table.instability)] * d.typical_instability
            )
            one = Eliminated.of(rows, there.state.columns, sizes)
            scores.append(
                rest
                + more
                + one.score
                + instability_log_prior(table.instability, d.typical_instability)
            )
        assert min(abs(table.score - s) for s in scores) < 1e-6
        for offer in table.offers:
            assert offer.instability == table.instability
        ranked = [o.score for o in table.offers]
        assert ranked == sorted(ranked, reverse=True)
    plain, small = (t for t in tables if t.instability == mode)
    assert plain.score == pytest.approx(there.score)
    starts = np.cumsum([0, *(len(g.columns) for g in d.always)])
    i = [g.cause for g in d.always].index("scale")
    wide = there.state.prior_sigma.copy()
    wide[starts[i] : starts[i + 1]] = d.always[i].prior_sigma(float(SIZES[0]))
    np.testing.assert_allclose(small.state.prior_sigma, wide)
    lost = DENSITY[0] - DENSITY[there.sizes.calibration[i]]
    expected = there.score - there.state.score + small.state.score + lost
    assert small.score == pytest.approx(expected)
    beside = lowered_instability(mode, (0, 1, 2), 6)
    fresh = SESSION.search(SESSION.noise(np.random.default_rng(seed), tau))
    again = fresh.sets.evaluate(())
    told = replace(again.sizes, instability=beside)
    assert {t.instability for t in fresh.offers.tables(again, told)} == {mode, beside}


def test_sizes_below_what_is_typical_are_opened_at_a_price() -> None:
    search = SESSION.search(SESSION.noise(np.random.default_rng(1)))
    there, d = search.sets.evaluate(()), SESSION.dictionary
    small = tuple(
        UNIT_INDEX - 3 if i == 0 else UNIT_INDEX + 2 for i in range(len(d.always))
    )
    sizes = replace(there.sizes, calibration=small)
    parts = [
        g.prior_sigma(float(SIZES[s]) if g.fixed_size is None else g.fixed_size)
        for g, s in zip(d.always, small, strict=True)
    ]
    state = replace(there.state, prior_sigma=np.concatenate(parts))
    wide, cost = with_typical_calibration(
        search.sets.dictionary, replace(there, sizes=sizes, state=state)
    )
    first = len(d.always[0].columns)
    np.testing.assert_allclose(
        wide[:first], d.always[0].prior_sigma(float(SIZES[UNIT_INDEX]))
    )
    np.testing.assert_array_equal(wide[first:], state.prior_sigma[first:])
    assert cost == pytest.approx(DENSITY[UNIT_INDEX] - DENSITY[UNIT_INDEX - 3])


def test_instabilities_fall_no_further_than_the_least() -> None:
    assert lowered_instability((9, 2, 5, 7, 7, 7, 7), (0, 1, 2), 3) == (
        6,
        0,
        2,
        7,
        7,
        7,
        7,
    )


def test_the_chance_of_a_set_is_its_causes_each_by_its_variants() -> None:
    search = SESSION.search(SESSION.noise(np.random.default_rng(0)))
    causes = {c.key: c for c in SESSION.dictionary.causes}
    offset, drift = causes["angle_offset"], causes["bias_drift:gyr"]
    members = ((offset, offset.variants[0]), (drift, drift.variants[-1]))
    expected = sum(np.log(c.chance / len(c.variants)) for c in (offset, drift))
    assert search.sets.set_log_prior(members) == pytest.approx(expected)
    key = search.sets.key(members)
    assert key == (("angle_offset", 0), ("bias_drift:gyr", len(drift.variants) - 1))
    both = search.sets.evaluate(members)
    assert search.sets.evaluate(members[::-1]) is both, "a set has no order"
    assert both.keys == {"angle_offset", "bias_drift:gyr"}
    less = search.sets.without(both, 0)
    assert less.keys == {"bias_drift:gyr"}
    start = both.sizes_of(less.members)
    assert start.members == both.sizes.members[1:]
    assert start.calibration == both.sizes.calibration
    assert start.instability == both.sizes.instability
