"""What a set is offered: its chance, and what it is begun with."""

from __future__ import annotations

from copy import copy
from dataclasses import replace

import numpy as np
import pytest
from small_sessions import Session, ladder

from fieldcal.model import priors, thresholds
from fieldcal.model.evidence.eliminated import Eliminated
from fieldcal.model.evidence.sets import Set, Sets, variant_log_priors
from fieldcal.model.evidence.sizing import UNIT_INDEX, Member, Sizes
from fieldcal.model.search.selection import Search
from fieldcal.model.search.set_at_instability import unlike_instabilities
from fieldcal.model.search.variations import visit_variations

KEYS = ("bias_drift:acc", "bias_drift:gyr", "cross_coupling", "settling:acc",
        "time:acc", "time:ax")  # fmt: skip
SESSION = Session.of(ladder(), KEYS)
CAUSES = {c.key: c for c in SESSION.dictionary.causes}


def drawn(seed: int = 1) -> Search:
    rng = np.random.default_rng(seed)
    off = SESSION.noise(rng, SESSION.dictionary.typical_instability)
    group = CAUSES["bias_drift:acc"].variants[0]
    off += 0.3 * SESSION.design[:, :, group.columns] @ group.typical
    return SESSION.search(off)


def having(search: Search, *keys: str) -> Set:
    members = tuple((CAUSES[k], CAUSES[k].variants[0]) for k in keys)
    return search.sets.evaluate(members)


def test_an_effect_on_the_other_triad_is_likelier_and_nothing_else_is() -> None:
    search = drawn()
    there = having(search, "bias_drift:acc", "time:acc")
    share, apart = search.offers.cause_log_priors(there)
    found = dict(zip(KEYS, share, strict=True))
    assert not apart, "the variants of each are alike"
    for key, cause in CAUSES.items():
        again = key.startswith("bias_drift")
        chance = priors.COMPANION_CHANCE if again else cause.chance
        assert found[key] == pytest.approx(np.log(chance / len(cause.variants)))
    np.testing.assert_array_equal(
        search.offers.cause_log_priors(search.sets.evaluate(()))[0],
        SESSION.dictionary.cause_log_priors,
    )


def test_each_cause_that_a_set_has_not_is_offered_once_the_best_first() -> None:
    search = drawn()
    there = having(search, "cross_coupling")
    offers = search.offers.ranked(there)
    keys = [o.member[0].key for o in offers]
    assert len(set(keys)) == len(keys) and "cross_coupling" not in keys
    scores = [o.score for o in offers]
    assert scores == sorted(scores, reverse=True)
    assert keys[0] == "bias_drift:acc" and scores[0] > there.score + 10
    every = [o for t in search.offers.tables(there) for o in t.offers]
    for offer in offers:
        same = [o.score for o in every if o.member[0].key == offer.member[0].key]
        assert offer.score == max(same)
    assert search.offers.tables(there) is search.offers.tables(there), "asked once"


def test_what_is_taken_begins_with_the_sizes_that_were_offered(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    search = drawn()
    there = having(search, "cross_coupling")
    one, two = search.offers.ranked(there)[:2]
    begun: list[tuple[tuple[Member, ...], Sizes]] = []
    monkeypatch.setattr(search.sets, "evaluate", lambda m, s: begun.append((m, s)))
    search.offers.accept(there, one, two)
    ((members, start),) = begun
    assert members == (*there.members, one.member, two.member)
    both = zip(one.calibration, two.calibration, there.sizes.calibration, strict=True)
    assert start.calibration == tuple(min(some) for some in both)
    assert start.members == (*there.sizes.members, one.size, two.size)
    both = zip(one.instability, two.instability, there.sizes.instability, strict=True)
    assert start.instability == tuple(min(some) for some in both)


JUMPS = Session.of(ladder(), ("bias_step:acc", "bias_step:gyr", "bias_drift:acc"))
ACC, GYR, DRIFT = JUMPS.dictionary.causes


def test_what_jumps_on_both_triads_jumps_at_once_or_is_two_events() -> None:
    (one, *_) = [g for g in GYR.variants if len(g.params) == 3][20:]
    shares = variant_log_priors(ACC, [(GYR, one)])
    at = np.array([g.shape["at_s"] for g in ACC.variants])
    at_once = np.abs(at - one.shape["at_s"]) == np.abs(at - one.shape["at_s"]).min()
    assert at_once.sum() == 4, "all axes together, or one"
    assert np.exp(shares[at_once]).sum() == pytest.approx(priors.COMPANION_CHANCE)
    np.testing.assert_allclose(shares[~at_once], np.log(ACC.chance / len(at)))
    for other in ([], [(DRIFT, DRIFT.variants[0])]):
        assert variant_log_priors(ACC, other) == pytest.approx(
            np.log(ACC.chance / len(at))
        )
    again = np.log(priors.COMPANION_CHANCE / len(DRIFT.variants))
    assert (
        variant_log_priors(DRIFT, [(replace(DRIFT, part="gyr"), DRIFT.variants[0])])
        == again
    )


def test_what_comes_of_one_event_begins_with_it() -> None:
    """Scale factors jump when biases do, as after a device has calibrated itself."""
    both = Session.of(ladder(), ("bias_step:acc", "scale_step", "mount_slip"))
    jump, scale, slip = (
        next(c for c in both.dictionary.causes if c.key == key)
        for key in ("bias_step:acc", "scale_step", "mount_slip")
    )
    group = [g for g in jump.variants if len(g.params) == 3][20]
    shares = variant_log_priors(scale, [(jump, group)])
    at = np.array([g.shape["at_s"] for g in scale.variants])
    off = np.abs(at - group.shape["at_s"])
    at_once = off == off.min()
    assert np.exp(shares[at_once]).sum() == pytest.approx(priors.COMPANION_CHANCE)
    alone = np.log(scale.chance / len(at))
    np.testing.assert_allclose(shares[~at_once], alone)
    assert variant_log_priors(scale, [(slip, slip.variants[0])]) == pytest.approx(alone)
    number = both.dictionary.causes.index(scale)
    search = both.search(both.noise(np.random.default_rng(2)))
    start = search.sets.evaluate(((jump, group),))
    _, by_variant = search.offers.cause_log_priors(start)
    np.testing.assert_allclose(by_variant[number], shares)


def test_where_the_device_may_have_been_off_both_triads_jump_by_some_size() -> None:
    at = sorted({g.shape["at_s"] for g in ACC.variants})[7]
    acc, gyr = (c.expecting_within([(at - 1e-3, at + 1e-3)]) for c in (ACC, GYR))
    whole = acc.variants[len(ACC.variants) :]
    assert acc.variants == (*ACC.variants, *whole) and {*whole} == acc.expected
    sizes = [g.own_sigma() / ACC.variants[0].typical[0] for g in whole]
    np.testing.assert_allclose(sizes, np.outer(priors.RESTART_SIZES, np.ones(3)))
    assert {g.shape["at_s"] for g in whole} == {at}
    assert all(len(g.params) == 3 for g in whole)
    alone, usual = variant_log_priors(acc, []), np.log(ACC.chance / len(acc.variants))
    assert np.exp(alone[-3:]) == pytest.approx(np.full(3, priors.RESTART_CHANCE / 3))
    np.testing.assert_allclose(alone[:-3], usual)
    for other in gyr.expected:
        both = variant_log_priors(acc, [(gyr, other)])
        odds = np.full(3, priors.BOTH_RESTART_ODDS / 3)
        assert np.exp(both[-3:]) == pytest.approx(odds)
        there = np.array([g.shape["at_s"] == at for g in ACC.variants])
        some = np.exp(both[:-3][there]).sum()
        assert some == pytest.approx(1 / priors.BOTH_RESTART_ODDS)
        np.testing.assert_allclose(both[:-3][~there], usual)
    assert DRIFT.expecting_within([(0.0, 1e3)]) is DRIFT, "it has no instant"
    assert ACC.expecting_within([]) is ACC
    (knock,) = Session.of(ladder(), ("base_step",)).dictionary.causes
    anew = knock.expecting_within([(at - 1e-3, at + 1e-3)])
    assert len(anew.expected) == 3, "set up anew meanwhile"
    assert np.exp(variant_log_priors(anew, [])[-3:]).sum() == pytest.approx(
        priors.RESTART_CHANCE
    )


@pytest.mark.parametrize("v", priors.RESTART_SIZES)
def test_a_jump_of_known_size_is_offered_with_the_evidence_of_that_size(
    v: float,
) -> None:
    """Not with that of the size which the rows show, which none of the three is."""
    session = Session.of(ladder(), ("bias_step:acc", "bias_step:gyr"))
    d = session.dictionary
    d.shown = np.ones(d.width, dtype=bool)
    d.expect_within([(110.0, 120.0)])
    acc, gyr = d.causes
    (at_s,) = {g.shape["at_s"] for g in acc.expected}
    off = session.noise(np.random.default_rng(5))
    off[d.x.t > at_s, :3] += v * acc.variants[0].typical[0]
    search = session.search(off)
    there = search.sets.evaluate(((gyr, gyr.variants[-1]),))
    each = {g: search.sets.evaluate((*there.members, (acc, g))) for g in acc.expected}
    most = max(acc.expected, key=lambda g: each[g].score)
    shares = dict(
        zip(acc.variants, variant_log_priors(acc, there.members), strict=True)
    )
    found = []
    for table in search.offers.tables(there):
        for offer in (o for o in table.offers if o.member[0] is acc):
            group = offer.member[1]
            gain = table.state.gain_by_size(group.columns, group.own_sigma())
            added = gain[UNIT_INDEX] + shares[group]
            assert offer.score == pytest.approx(table.score + added)
            found.append(group)
    assert most in found
    # where its size is little less likely than another, that is visited as well
    anew = session.search(off).sets
    best = anew.evaluate(each[most].members)
    visit_variations(anew, best, best.score)
    near = [one for one in each.values() if one.score > best.score - 5.5]
    assert len(near) > 1 or v == 1.0
    assert all(anew.key(one.members) in anew.visited for one in near)


@pytest.mark.parametrize("off", [True, False], ids=["off", "on"])
def test_what_no_row_shows_of_a_restart_is_offered_all_the_same(off: bool) -> None:
    """Of no force afterwards the likelihood gains nothing, and the odds are 20."""
    whole = Session.of(ladder(), ("bias_step:acc", "bias_step:gyr"))
    at = whole.dictionary.x.t
    known = [
        np.where((p.channel < 3) & (at[p.rows] > 115.0), 1e-9, 1.0)
        for p in whole.linear
    ]
    linear = (
        replace(p, design=p.design * w[:, None], weight=p.weight * w)
        for p, w in zip(whole.linear, known, strict=True)
    )
    session = replace(whole, linear=tuple(linear))
    d = session.dictionary
    d.shown = np.ones(d.width, dtype=bool)
    d.expect_within([(110.0, 120.0)] if off else [])
    acc, gyr = d.causes
    search = session.search(np.zeros((len(d.x), 6)))
    there = search.sets.evaluate(((gyr, gyr.variants[-1]),))
    found = {o.member[0].key: o for o in search.offers.ranked(there)}
    assert bool(acc.expected) == off == (acc.key in found)
    if off:
        offer = found[acc.key]
        assert offer.member[1] in acc.expected
        assert 0 < offer.score - there.score < np.log(priors.BOTH_RESTART_ODDS)


@pytest.mark.parametrize("seed", range(3))
def test_a_jump_that_one_triad_hardly_shows_is_when_the_other_jumps(seed: int) -> None:
    rng, x = np.random.default_rng(seed), JUMPS.dictionary.x
    off = JUMPS.noise(rng)
    off[x.t > 130.0] += np.repeat([4e-4, 1e-4], 3)
    best = JUMPS.search(off).run()
    found = {c.part: g.shape["at_s"] for c, g in best.members}
    assert set(found) == {"acc", "gyr"}
    assert found["acc"] == pytest.approx(found["gyr"])
    search = JUMPS.search(off)
    acc, gyr = (next(m for m in best.members if m[0] is c) for c in (ACC, GYR))
    assert search.sets.set_log_prior((acc, gyr)) == pytest.approx(
        search.sets.set_log_prior((gyr, acc))
    )
    both = search.sets.evaluate((gyr, acc))
    offered = search.offers.ranked(search.sets.evaluate((gyr,)), both.sizes)
    (offer,) = [o for o in offered if o.member[0] is ACC]
    assert offer.member[1].shape == acc[1].shape
    taken = search.offers.accept(search.sets.evaluate((gyr,)), offer)
    assert abs(taken.score - offer.score) < 2 * thresholds.PREDICTION_SLACK


def test_what_is_known_from_elsewhere_stays_so_large_beside_every_offer() -> None:
    """Gravity is known so well: held to nothing, it would make offers look better."""
    plain = drawn()
    d = copy(plain.sets.dictionary)
    d.always = [replace(g, in_state=False) for g in d.always]
    search = Search(Sets(d, plain.sets.gram))
    nothing = search.sets.evaluate(())
    known = [g.columns for g in d.always if g.fixed_size is not None]
    at = np.isin(nothing.state.columns, np.concatenate(known))
    assert at.any()
    for table in search.offers.tables(nothing):
        np.testing.assert_array_equal(
            table.state.prior_sigma[at], nothing.state.prior_sigma[at]
        )


def test_instabilities_that_the_means_cannot_tell_apart_are_one() -> None:
    """Too small ones, of which axes alike are the likeliest; a set's own one stays."""
    sets = drawn().sets
    own, large = (17, 16, 18, 15, 15, 15, 16), (17, 16, 18, 14, 14, 14, 16)
    small, less, none = ((n + 1, n, n + 2, *own[3:]) for n in (4, 2, 0))
    alike = (3, 3, 3, *own[3:])
    every = [own, large, own[:3] + small[:3] + own[6:], small, less, none, alike]
    kept = unlike_instabilities(sets, every)
    assert kept == [*every[:3], alike]
    group = CAUSES["bias_drift:acc"].variants[0]
    state = sets.evaluate(()).state
    gains = [
        Eliminated.of(sets.gram_at(one), state.columns, state.prior_sigma).gain_by_size(
            group.columns, group.typical
        )
        for one in (small, less, none, alike, own)
    ]
    for gain in gains[:3]:
        np.testing.assert_allclose(gain, gains[3], rtol=1e-5)
    assert np.abs(gains[4] - gains[3]).max() > 0.1
    assert len(unlike_instabilities(sets, [none, less, small])) == 2
    assert unlike_instabilities(sets, [alike]) == [alike]
