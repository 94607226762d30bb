"""What a set is offered: its chance, and what it is begun with."""

from __future__ import annotations

import numpy as np
import pytest
from small_sessions import Session, ladder

from fieldcal.model import priors
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import Member, Sizes
from fieldcal.model.search.selection import Search

KEYS = ("bias_drift:acc", "bias_drift:gyr", "cross_coupling", "settling:acc",
        "time:acc", "time:ax")  # fmt: skip
SESSION = Session.of(ladder(), KEYS)
CAUSES = {c.key: c for c in SESSION.dictionary.causes}


def drawn(seed: int = 1) -> Search:
    rng = np.random.default_rng(seed)
    off = SESSION.noise(rng, SESSION.dictionary.unstable)
    group = CAUSES["bias_drift:acc"].variants[0]
    off += 0.3 * SESSION.design[:, :, group.columns] @ group.typical
    return SESSION.search(off)


def having(search: Search, *keys: str) -> Set:
    members = tuple((CAUSES[k], CAUSES[k].variants[0]) for k in keys)
    return search.evaluated(members)


def test_an_effect_on_the_other_triad_is_likelier_and_nothing_else_is() -> None:
    search = drawn()
    there = having(search, "bias_drift:acc", "time:acc")
    found = dict(zip(KEYS, search._chances(there), strict=True))
    for key, cause in CAUSES.items():
        again = key.startswith("bias_drift")
        chance = priors.AGAIN if again else cause.chance
        assert found[key] == pytest.approx(np.log(chance / len(cause.variants)))
    np.testing.assert_array_equal(
        search._chances(search.evaluated(())), SESSION.dictionary.chances
    )


def test_each_cause_that_a_set_has_not_is_offered_once_the_best_first() -> None:
    search = drawn()
    there = having(search, "cross_coupling")
    offers = search.offers(there)
    keys = [o.member[0].key for o in offers]
    assert len(set(keys)) == len(keys) and "cross_coupling" not in keys
    scores = [o.score for o in offers]
    assert scores == sorted(scores, reverse=True)
    assert keys[0] == "bias_drift:acc" and scores[0] > there.score + 10
    every = [o for t in search.tables(there) for o in t.offers]
    for offer in offers:
        same = [o.score for o in every if o.member[0].key == offer.member[0].key]
        assert offer.score == max(same)
    assert search.tables(there) is search.tables(there), "asked once"


def test_what_is_taken_begins_with_the_sizes_that_were_offered(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    search = drawn()
    there = having(search, "cross_coupling")
    one, two = search.offers(there)[:2]
    begun: list[tuple[tuple[Member, ...], Sizes]] = []
    monkeypatch.setattr(search, "evaluated", lambda m, s: begun.append((m, s)))
    search.taken(there, one, two)
    ((members, start),) = begun
    assert members == (*there.members, one.member, two.member)
    assert start.calibration == there.sizes.calibration
    assert start.members == (*there.sizes.members, one.size, two.size)
    both = zip(one.less, two.less, there.sizes.instability, strict=True)
    assert start.instability == tuple(min(some) for some in both)


def test_wide_groups_are_looked_up_where_rows_say_the_same_of_them() -> None:
    search = drawn()
    rng = np.random.default_rng(2)
    root = rng.standard_normal((3, 40, 40))
    inner = root @ root.swapaxes(1, 2)
    pull, own = rng.standard_normal((3, 40)), np.full(3, 80.0)
    found = search._gains(inner, pull, own)
    again = search._gains(inner[::-1], pull[::-1], own)
    np.testing.assert_array_equal(found, again[::-1])
    at = int(np.argmin(np.abs(np.log(priors.SIZES))))
    v = float(priors.SIZES[at])
    for i in range(3):
        scaled = np.linalg.solve(inner[i] + np.eye(40) / v**2, pull[i])
        log_det = np.linalg.slogdet(np.eye(40) + v**2 * inner[i])[1]
        assert found[i, at] == pytest.approx(0.5 * (pull[i] @ scaled - log_det))
