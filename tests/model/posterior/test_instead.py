"""What may stand in the place of a cause, on rows of which it is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_sessions import Session, ladder

from fieldcal.effects import catalogue
from fieldcal.model import thresholds
from fieldcal.model.evidence.sets import Set
from fieldcal.model.posterior import probabilities
from fieldcal.model.posterior.probabilities import Posterior, ProbableCause
from fieldcal.model.search.selection import Search

KEYS = ("bias_drift:acc", "bias_drift:gyr", "temperature_bias:acc",
        "temperature_bias:gyr", "cross_coupling", "settling:acc")  # fmt: skip
SESSION = Session.of(ladder(), KEYS)
CAUSES = {c.key: c for c in SESSION.dictionary.causes}


def drifting(size: float = 0.3, gyr: float = 0.3) -> tuple[Search, Set]:
    """Both triads drift, which a temperature that rises evenly does as well."""
    rng = np.random.default_rng(3)
    off = SESSION.noise(rng)
    for key, by in (("bias_drift:acc", size), ("bias_drift:gyr", gyr)):
        group = CAUSES[key].variants[0]
        off += by * SESSION.design[:, :, group.columns] @ group.typical
    search = SESSION.search(off)
    return search, search.run()


def test_an_evidence_is_a_score_without_the_chances() -> None:
    search, best = drifting()
    posterior = Posterior(search, best)
    empty = search.sets.evaluate(())
    assert posterior.evidence(empty) == pytest.approx(empty.score)
    settling = CAUSES["settling:acc"]
    one = search.sets.evaluate(((settling, settling.variants[0]),))
    assert posterior.evidence(one) == pytest.approx(one.score - np.log(settling.chance))


def test_what_stands_in_a_cause_s_place_stands_on_both_triads() -> None:
    search, best = drifting()
    assert len(best.members) == 2
    posterior = Posterior(search, best)
    (name,) = posterior.cause_names(best)
    other = {"bias_drift": "temperature_bias", "temperature_bias": "bias_drift"}[name]
    assert set(posterior.alternatives[name]) == {other}
    alias = posterior.alternatives[name][other]
    assert alias.keys == {f"{other}:acc", f"{other}:gyr"}
    near = posterior.evidence(best) - posterior.evidence(alias)
    assert abs(near) < thresholds.ALIAS_LOG_MARGIN
    assert posterior.without(name).members == ()
    (found,) = posterior.probable_causes()
    assert (found.name, found.aliases) == (name, (other,))
    assert found.triads == {"acc", "gyr"} and found.kind == "effect"
    assert found.members == best.members
    assert found.probability == pytest.approx(posterior.probability([name, other]))
    assert posterior.probability([name]) < found.probability
    assert posterior._kind("settling") == "effect"


def test_what_its_chance_brings_near_counts_though_its_evidence_is_behind(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A course that no effect has shows a little more than a walk, and is rarer."""
    session = Session.of(ladder(), ("time:acc", "random_walk:acc"))
    off, x = session.noise(np.random.default_rng(3)), session.dictionary.x
    part = (x.t - x.t.min()) / np.ptp(x.t)
    bent = part + 0.76 * part * (1 - part)
    off[:, :3] += 3e-3 * bent[:, None] * [1.0, -0.5, 0.7]
    free = next(c for c in session.dictionary.causes if c.name == "time")
    for patience, counts in ((1.0, True), (-3.0, False)):
        search = session.search(off)
        best = max((search.sets.evaluate(((free, v),)) for v in free.variants),
                   key=lambda s: s.score)  # fmt: skip
        monkeypatch.setattr(thresholds, "ALTERNATIVE_LOG_DISTANCE", patience)
        walks = {s.keys: w for s, w in Posterior(search, best).weights}
        assert (frozenset({"random_walk:acc"}) in walks) == counts
        assert not counts or walks[frozenset({"random_walk:acc"})] > 0.5


def test_a_function_that_no_effect_makes_is_no_other_name_for_an_effect() -> None:
    session = Session.of(ladder(), ("time:acc", "random_walk:acc"))
    off, x = session.noise(np.random.default_rng(3)), session.dictionary.x
    part = (x.t - x.t.min()) / np.ptp(x.t)
    bent = part + 0.76 * part * (1 - part)
    off[:, :3] += 3e-3 * bent[:, None] * [1.0, -0.5, 0.7]
    search = session.search(off)
    (walk,) = (c for c in session.dictionary.causes if c.name == "random_walk")
    posterior = Posterior(search, search.sets.evaluate(((walk, walk.variants[0]),)))
    (found,) = posterior.probable_causes()
    assert (found.aliases, found.aliases_of_kind) == (("time",), ())
    own, both = (
        posterior.probability(n) for n in (["random_walk"], ["random_walk", "time"])
    )
    assert found.probability == pytest.approx(own)
    assert own < both


def test_the_weights_are_of_the_sets_and_of_what_was_refined() -> None:
    search, best = drifting()
    posterior = Posterior(search, best)
    sets = [s for s, _ in posterior.weights]
    assert len(sets) == len(search.sets.visited)
    score = np.array([s.score for s in sets])
    share = np.exp(score - score.max())
    weights = np.array([w for _, w in posterior.weights])
    np.testing.assert_allclose(weights, share / share.sum(), rtol=1e-6, atol=1e-300)


def test_what_fades_is_looked_at_between_the_points_of_its_grid() -> None:
    """Only where it is no alias on them, and only what was not refined already."""
    search, best = drifting()
    settling = CAUSES["settling:acc"]
    group = settling.variants[5]
    assert probabilities._has_time_constant(group)
    assert not probabilities._has_time_constant(CAUSES["cross_coupling"].variants[0])
    asked: list[Set] = []

    def refined(there: Set) -> Set:
        asked.append(there)
        return replace(there, score=there.score + 50.0)

    posterior = Posterior(search, best, refined)
    asked.clear()
    there = search.sets.evaluate((*best.members, (settling, group)))
    bare = posterior.evidence(there)
    assert posterior._refined_evidence(there, bare + 4.0) == pytest.approx(bare)
    assert asked == []
    assert posterior._refined_evidence(there, bare + 10.0) == pytest.approx(bare + 50.0)
    assert asked == [there]
    assert posterior._refined_evidence(best, 1e9) == pytest.approx(
        posterior.evidence(best)
    )
    assert asked == [there], "nothing in it fades"
    plain = Posterior(search, best)
    assert plain._refined_evidence(there, bare + 10.0) == pytest.approx(bare)


def test_what_is_hardly_there_is_not_said() -> None:
    search, best = drifting(0.0, 0.0)
    assert best.members == ()
    assert Posterior(search, best).probable_causes() == []
    there = search.sets.evaluate(((CAUSES["cross_coupling"],
                               CAUSES["cross_coupling"].variants[0]),))  # fmt: skip
    assert Posterior(search, there).probable_causes() == [], "another set is likelier"


def test_an_effect_of_everything_is_on_both_triads() -> None:
    cause = CAUSES["cross_coupling"]
    one = ProbableCause("a", ((cause, cause.variants[0]),), 1.0, ())
    assert one.triads == {"acc", "gyr"}
    acc = CAUSES["bias_drift:acc"]
    assert ProbableCause("a", ((acc, acc.variants[0]),), 1.0, ()).triads == {"acc"}
    assert replace(one, members=((acc, acc.variants[0]),)).kind == "effect"


@pytest.mark.parametrize(
    ("name", "has"),
    [("warm_up", True), ("settling", True), ("joint_creep", True),
     ("bias_step", False), ("temperature_bias", False)],
)  # fmt: skip
def test_a_time_constant_is_of_a_session_a_turn_or_a_joint(
    name: str, has: bool
) -> None:
    """An instant is none, and a coefficient has no shape."""
    group = replace(CAUSES["settling:acc"].variants[5], effect=catalogue()[name])
    assert probabilities._has_time_constant(group) == has


def test_sets_near_the_best_are_varied_and_no_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The best among them; of nothing there is nothing to vary."""
    search, best = drifting()
    varied: list[tuple[Set, float]] = []
    monkeypatch.setattr(
        probabilities, "visit_variations", lambda _, *there: varied.append(there)
    )
    far = [s for s in search.sets.visited.values()
           if s.score <= best.score - thresholds.AVERAGED_LOG_DISTANCE]  # fmt: skip
    assert far and best.members
    Posterior(search, best)
    sets = [one for one, _ in varied]
    assert best in sets and not any(one in far for one in sets)
    assert {top for _, top in varied} == {best.score}
    varied.clear()
    Posterior(search, search.sets.evaluate(()))
    assert varied == []
