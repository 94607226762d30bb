"""The search, on rows drawn from the model itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from small_sessions import Session, ladder

from fieldcal.core.samples import Array
from fieldcal.model import priors
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.evidence.eliminated import Eliminated
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.posterior.probabilities import Posterior
from fieldcal.model.priors import SIZES
from fieldcal.model.search.offers import Offer
from fieldcal.model.search.pairs import pair_gains
from fieldcal.model.search.selection import Search
from fieldcal.model.search.variations import widen_outputs

DENSITY = np.log(priors.density())
EVEN = int(np.argmin(np.abs(np.log(SIZES))))
KEYS = (
    "angle_offset",
    "cross_coupling",
    "g_sensitivity",
    "bias_drift:gyr",
    "settling:acc",
    "random_walk:gyr",
    "alpha:ay",
)
SUSPECTED = ("angle_offset", "quadratic", "g2_sensitivity", "bias_drift:gyr")
SESSION = Session.of(ladder(), KEYS)
CAUSES = {c.key: c for c in SESSION.dictionary.causes}
QUIET = np.zeros(7)


def unstable(share: float = 1.0) -> Array:
    return SESSION.dictionary.typical_instability * share


def made(groups: Sequence[Group], rng: np.random.Generator, v: float = 1.0) -> Array:
    """What groups of some size add to the outputs, (n, 6)."""
    out = np.zeros((len(SESSION.dictionary.x), 6))
    for g in groups:
        out += SESSION.design[:, :, g.columns] @ (
            g.prior_sigma(v) * rng.standard_normal(len(g.columns))
        )
    return out


def fixed(session: Session) -> Session:
    """The same where all sizes of what is always there are known."""
    d = session.dictionary
    known = replace(session, dictionary=d.calibration_only())
    known.dictionary.always = [
        replace(g, fixed_size=1.0, changes_together=False) for g in d.always
    ]
    known.dictionary.typical_instability = QUIET
    return known


KNOWN = fixed(SESSION)


def there(key: str) -> tuple[Cause, Group]:
    """A cause with one of its variants, that of the longest time constant."""
    cause, few = CAUSES[key], len(CAUSES[key].variants[0].columns)
    return cause, [g for g in cause.variants if len(g.columns) == few][-1]


def true_and_found(keys: Sequence[str], seed: int) -> tuple[Set, Set]:
    """The set that rows were drawn from, and the one that a search finds."""
    rng = np.random.default_rng(seed)
    members = tuple(there(key) for key in keys)
    off = SESSION.noise(rng, unstable(0.1)) + made([g for _, g in members], rng)
    search = SESSION.search(off)
    best = search.run()
    assert best.score == max(s.score for s in search.sets.visited.values())
    return search.sets.evaluate(members), best


@pytest.mark.parametrize(
    "keys",
    [
        ("cross_coupling",),
        ("settling:acc",),
        ("random_walk:gyr",),
        ("bias_drift:gyr", "angle_offset"),
        ("g_sensitivity", "settling:acc"),
    ],
    ids=" ".join,
)
def test_a_set_that_is_there_is_found(keys: tuple[str, ...]) -> None:
    for seed in range(3):
        true, best = true_and_found(keys, seed)
        assert best.keys == set(keys)
        assert best.score >= true.score - 0.05


@pytest.mark.parametrize(("second", "more"), [(0.05, True), (0.0, False)])
def test_a_step_is_on_as_many_outputs_as_show_it(second: float, more: bool) -> None:
    """One that is found on one axis, as another cause did the rest of it."""
    session = Session.of(ladder(), ("bias_step:gyr",))
    (step,) = session.dictionary.causes
    instant = step.variants[len(step.variants) // 16].shape
    at = {g.params: g for g in step.variants if g.shape == instant}
    off = session.noise(np.random.default_rng(3), QUIET)
    size = at[3, 4, 5].typical * np.array([0.05, second, 0.0])
    off += session.design[:, :, at[3, 4, 5].columns] @ size
    search = session.search(off)
    alone = search.sets.evaluate(((step, at[3,]),))
    found = widen_outputs(search.sets, alone)
    assert (found.members[0][1] is at[3, 4, 5]) == more
    assert (found.score > alone.score + 3) if more else found is alone


@pytest.mark.parametrize("seed", [1, 2])
def test_what_the_instability_of_one_triad_hides_is_found(seed: int) -> None:
    """Where the other one has an instability that nothing explains."""
    true, best = true_and_found(("alpha:ay",), seed)
    assert best.score >= true.score - 0.05


@pytest.mark.parametrize("count", [40, pytest.param(100, marks=pytest.mark.thorough)])
def test_where_nothing_is_nothing_is_said(count: int) -> None:
    """Of what is said with half a chance at least, and not of what is suspected."""
    said, empty = 0, 0
    session = Session.of(ladder(2), SUSPECTED)
    for seed in range(count):
        rng = np.random.default_rng(1000 + seed)
        tau = unstable() * np.exp(rng.normal(-1.5, priors.AXES_LOG_SPREAD, 7))
        search = session.search(session.noise(rng, tau))
        best = search.run()
        empty += not best.members
        said += bool(Posterior(search, best).probable_causes())
    assert said <= 1
    assert empty >= count - 1


def with_sizes(empty: Set, groups: Sequence[Group], sizes: Sequence[int]) -> float:
    """F of a set with more groups, all of them with these sizes."""
    columns = np.concatenate([empty.state.columns, *(g.columns for g in groups)])
    wide = [g.prior_sigma(float(SIZES[i])) for g, i in zip(groups, sizes, strict=True)]
    whole = np.concatenate([empty.state.prior_sigma, *wide])
    state = Eliminated.of(empty.state.rows, columns, whole)
    return state.score + float(sum(DENSITY[i] for i in sizes))


@pytest.mark.parametrize("seed", range(3))
def test_what_pairs_gain_is_what_their_sets_gain(seed: int) -> None:
    rng = np.random.default_rng(seed)
    groups = [c.variants[0] for c in CAUSES.values()]
    off = KNOWN.noise(rng) + made(groups[:3], rng, 0.02)
    search = KNOWN.search(off)
    empty = search.sets.evaluate(())
    seen = set()
    alone = [EVEN] * len(groups)
    for gain, (i, j), (u, v) in pair_gains(empty.state, groups, alone):
        two = [groups[i], groups[j]]
        expected = with_sizes(empty, two, (u, v)) - empty.state.score
        assert gain == pytest.approx(expected, rel=1e-9, abs=1e-7)
        members = tuple((c, c.variants[0]) for c in [*CAUSES.values()])
        start = replace(empty.sizes, members=(u, v))
        both = search.sets.evaluate((members[i], members[j]), start)
        found = with_sizes(empty, two, both.sizes.members) - empty.state.score
        assert -1e-7 <= found - gain < 1.0, "the likeliest sizes of the pair"
        seen.add((i, j))
    assert seen == set(combinations(range(len(groups)), 2))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("keys", [("cross_coupling", "angle_offset"),
                                  ("random_walk:gyr", "bias_drift:gyr")])  # fmt: skip
def test_sizes_are_those_that_trying_all_finds(
    keys: tuple[str, str], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    two = [CAUSES[key].variants[0] for key in keys]
    search = KNOWN.search(KNOWN.noise(rng) + made(two, rng, 0.3))
    found = search.sets.evaluate(
        tuple((CAUSES[k], CAUSES[k].variants[0]) for k in keys)
    )
    empty = search.sets.evaluate(())
    some = range(12, 24)
    every = np.array([[with_sizes(empty, two, (u, v)) for v in some] for u in some])
    u, v = np.unravel_index(every.argmax(), every.shape)
    assert found.sizes.members == (some[u], some[v])
    top = every[u, v]
    beside = [
        [with_sizes(empty, two, (i, some[v])) for i in range(len(SIZES))],
        [with_sizes(empty, two, (some[u], i)) for i in range(len(SIZES))],
    ]
    total = top + sum(np.logaddexp.reduce(np.array(b) - top) for b in beside)
    chance = sum(np.log(CAUSES[k].chance / len(CAUSES[k].variants)) for k in keys)
    assert found.score == pytest.approx(total + chance, rel=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_instabilities_are_those_that_trying_all_finds(seed: int) -> None:
    """Of the three accelerometers, each of which may be another."""
    known = fixed(SESSION)
    known.dictionary.typical_instability = np.where(np.arange(7) < 3, unstable(), 0.0)
    rng = np.random.default_rng(seed)
    tau = known.dictionary.typical_instability * 2.0 * np.exp(rng.normal(0, 0.3, 7))
    search = known.search(known.noise(rng, tau))
    found, some = search.sets.evaluate(()), range(12, 23)
    columns, wide = found.state.columns, found.state.prior_sigma
    small = search.sets.gram.select_columns(columns)

    def score(x: int, y: int, z: int) -> float:
        sizes = np.array([SIZES[i] for i in (x, y, z, 0, 0, 0, 0)])
        rows = small.with_instability(sizes * known.dictionary.typical_instability)
        prior = search.sets.instability_log_prior((x, y, z, 0, 0, 0, 0))
        return Eliminated.of(rows, columns, wide).score + float(prior)

    every = {(x, y, z): score(x, y, z) for x in some for y in some for z in some}
    best = max(every, key=lambda at: every[at])
    assert every[found.sizes.instability[:3]] > every[best] - 0.2  # type: ignore[index]


def test_instabilities_of_a_triad_are_likelier_alike() -> None:
    search = SESSION.search(SESSION.noise(np.random.default_rng(0)))
    even = (16, 16, 16, 12, 12, 12, 0)
    level = search.sets.instability_log_prior(even)
    for unlike in ((14, 16, 18), (16, 16, 13), (20, 14, 14)):
        assert search.sets.instability_log_prior((*unlike, *even[3:])) < level - 2
        assert search.sets.instability_log_prior(
            (*even[:3], *unlike, 0)
        ) < search.sets.instability_log_prior((*even[:3], 16, 16, 16, 0))
    assert search.sets.instability_log_prior(
        (12, 12, 12, 16, 16, 16, 0)
    ) == pytest.approx(level)
    larger = [
        search.sets.instability_log_prior((*[i] * 3, 12, 12, 12, 0))
        for i in range(len(SIZES))
    ]
    assert (np.diff(larger) <= 0).all() and larger[24] < larger[16] - 10
    many = np.array([even, (14, 16, 18, 12, 12, 12, 0)])
    np.testing.assert_allclose(
        search.sets.instability_log_prior(many),
        [search.sets.instability_log_prior(row) for row in many],
    )


def test_the_chance_of_a_set_is_that_of_its_causes() -> None:
    """The other triad of an effect that is there is likelier than by itself."""
    session = Session.of(ladder(), ("settling:acc", "settling:gyr", "alpha:ay"))
    by_key = {c.key: c for c in session.dictionary.causes}
    acc, gyr, other = by_key.values()
    sets = session.search(session.noise(np.random.default_rng(0))).sets
    first = (acc, acc.variants[0])
    assert sets.set_log_prior([]) == 0.0
    assert sets.set_log_prior([first]) == pytest.approx(
        np.log(acc.chance / len(acc.variants))
    )
    both = sets.set_log_prior([first, (gyr, gyr.variants[3])])
    again = np.log(priors.COMPANION_CHANCE / len(gyr.variants))
    assert both == pytest.approx(sets.set_log_prior([first]) + again)
    three = sets.set_log_prior(
        [first, (gyr, gyr.variants[3]), (other, other.variants[0])]
    )
    assert three == pytest.approx(both + np.log(priors.UNKNOWN_FUNCTION_CHANCE))


def test_an_offer_foretells_the_set_with_it() -> None:
    """Exactly, but for what other sizes become beside it."""
    rng = np.random.default_rng(4)
    search: Search = KNOWN.search(
        KNOWN.noise(rng) + made([CAUSES["angle_offset"].variants[0]], rng, 0.1)
    )
    empty = search.sets.evaluate(())
    offers = search.offers.ranked(empty)
    assert offers[0].member[0].key == "angle_offset"
    for offer in offers:
        predicted = offer.score
        assert search.offers.accept(empty, offer).score == pytest.approx(
            predicted, rel=1e-9
        )
        assert offer.size == search.offers.accept(empty, offer).sizes.members[0]


@pytest.mark.parametrize(
    ("worth", "told"), [((-0.1, -0.6), "angle_offset"), ((-2.0, -3.0), "alpha:ay")]
)
def test_several_effects_are_likelier_than_a_function_that_none_makes(
    worth: tuple[float, float], told: str
) -> None:
    """Together, though each alone is a little less likely than it."""
    search = SESSION.search(np.zeros((len(SESSION.dictionary.x), 6)))
    empty = search.sets.evaluate(())
    scores = {"alpha:ay": 0.0, "angle_offset": worth[0], "settling:acc": worth[1]}
    sets = {k: replace(empty, members=(there(k),), score=v) for k, v in scores.items()}
    assert CAUSES["alpha:ay"].kind == "unknown"
    search.sets.visited = {search.sets.key(s.members): s for s in sets.values()}
    search.sets.visited[()] = replace(empty, score=-9.0)
    assert search._prefer_effects(sets["alpha:ay"]) is sets[told]
    assert search._prefer_effects(sets["settling:acc"]) is sets["settling:acc"]


def test_instead_of_a_function_two_causes_are_tried_beside_all_parameters_too(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A function may do what a parameter does that a cause was not given."""
    drift, wave = CAUSES["bias_drift:gyr"], CAUSES["alpha:ay"]
    part = next(g for g in drift.variants if len(g.params) == 1)
    search = SESSION.search(SESSION.noise(np.random.default_rng(1)))
    current = search.sets.evaluate(((drift, part), (wave, wave.variants[0])))
    asked: list[tuple[str, Set, float]] = []
    for name in ("_with_two_more", "_with_one_more"):

        def noted(there: Set, level: float, name: str = name) -> Set:
            asked.append((name, there, level))
            return there

        monkeypatch.setattr(search, name, noted)
    found = search._without_function(current)
    assert all(level == current.score for *_, level in asked)
    tried = [(name, [g for _, g in there.members]) for name, there, _ in asked]
    whole = drift.full_variant(part)
    assert whole is not part
    two, one = "_with_two_more", "_with_one_more"
    assert tried == [(two, [part]), (one, [part]), (two, [whole]), (one, [whole])]
    assert found.score == max(current.score, *(there.score for _, there, _ in asked))
    asked.clear()
    plain = search.sets.evaluate(((drift, part),))
    assert search._without_function(plain) is plain and not asked


def test_one_cause_is_tried_in_place_of_two(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where neither another in its place nor its absence alone raises the weight."""
    jump, aside, slip = "settling:acc", "angle_offset", "cross_coupling"
    far, drift = "g_sensitivity", "bias_drift:gyr"
    scores = {
        (jump, aside): 0.0, (jump,): -7.0, (aside,): -90.0, (): -95.0,
        (aside, slip): -0.7, (slip,): 6.0, (aside, far): -70.0,
    }  # fmt: skip
    search = SESSION.search(np.zeros((len(SESSION.dictionary.x), 6)))
    empty, asked = search.sets.evaluate(()), set[frozenset[str]]()

    def evaluated(members: Sequence[Member], sizes: object = None) -> Set:
        asked.add(frozenset(c.key for c, _ in members))
        known = {frozenset(keys): score for keys, score in scores.items()}
        score = known.get(frozenset(c.key for c, _ in members), -99.0)
        return replace(empty, members=tuple(members), score=score)

    def without(whole: Set, i: int) -> Set:
        return evaluated((*whole.members[:i], *whole.members[i + 1 :]))

    def ranked(current: Set, sizes: object) -> list[Offer]:
        # predicted with sizes that suit none of them
        foretold = {jump: -80.0, slip: -81.0, drift: -94.0}
        return [Offer(there(k), v, 0, empty.sizes.calibration, empty.sizes.instability)
                for k, v in foretold.items() if k not in current.keys]  # fmt: skip

    monkeypatch.setattr(search.sets, "evaluate", evaluated)
    monkeypatch.setattr(search.sets, "without", without)
    monkeypatch.setattr(search.offers, "ranked", ranked)
    monkeypatch.setattr(
        search.offers, "accept", lambda now, one: evaluated((*now.members, one.member))
    )
    current = evaluated((there(jump), there(aside)))
    assert search._with_one_replaced(current).score == current.score
    found = search._with_one_for_two(current)
    assert found.keys == {slip} and found.score == 6.0
    assert not any(drift in keys for keys in asked)  # of no use beside the others
    assert search._with_one_for_two(found) is found


DRIFTS = ("bias_drift:acc", "bias_drift:gyr")
WARMING = ("warm_up:acc", "warm_up:gyr")


def drawn_from(session: Session, keys: Sequence[str], seed: int) -> Search:
    """A search in rows that are drawn from causes of a session."""
    rng = np.random.default_rng(seed)
    causes = {c.key: c for c in session.dictionary.causes}
    off = session.noise(rng)
    for key in keys:
        group = causes[key].variants[-1]
        typical = 3.0 * group.prior_sigma(1.0)
        off += session.design[:, :, group.columns] @ (
            typical * np.sign(rng.standard_normal(len(group.columns)))
        )
    return session.search(off)


@pytest.mark.parametrize("seed", range(3))
def test_an_effect_of_both_triads_is_replaced_in_both(seed: int) -> None:
    """Beside a drift of one triad, the warm-up of the other has no companion."""
    session = Session.of(ladder(), (*DRIFTS, *WARMING))
    search = drawn_from(session, WARMING, seed)
    causes = {c.key: c for c in session.dictionary.causes}
    whole = tuple((causes[key], causes[key].variants[-1]) for key in DRIFTS)
    current = search.sets.evaluate(whole)
    found = search._with_both_parts_replaced(current)
    assert found.keys == {*WARMING} and found.score > current.score
    assert search._with_both_parts_replaced(found).score == found.score
    alone = search.sets.evaluate(whole[:1])
    assert search._with_both_parts_replaced(alone) is alone


@pytest.mark.parametrize("seed", range(3))
def test_two_causes_are_tried_in_place_of_one(seed: int) -> None:
    """Neither of them explains the rows as well as the one in their place."""
    true = ("cross_coupling", "g_sensitivity")
    search = drawn_from(SESSION, true, seed)
    current = search.sets.evaluate((there("angle_offset"),))
    found = search._with_two_for_one(current)
    assert found.keys == {*true} and found.score > current.score
    visited = [s.keys for s in search.sets.visited.values()]
    assert frozenset(true) in visited
