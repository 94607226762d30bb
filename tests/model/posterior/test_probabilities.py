"""What is said with a probability is true so often; what is estimated is so near.

Rows are drawn from the prior: causes by their chances, sizes, instabilities and values
of columns by what the model has of them.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
import pytest
from scipy.stats import binomtest, chi2
from small_sessions import Session, ladder

from fieldcal.core.samples import Array
from fieldcal.model import priors
from fieldcal.model.evidence.eliminated import Eliminated
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.posterior.mixture import Mixing
from fieldcal.model.posterior.model_average import average_over_sizes
from fieldcal.model.posterior.probabilities import Posterior
from fieldcal.model.priors import SIZES
from fieldcal.model.search.selection import Search
from fieldcal.model.search.set_at_instability import with_typical_calibration

ODDS = 0.5
"""Of a cause, for which the chance of one stands where chances are small."""

DRAWS, FEW = 220, 72
ALL = pytest.param(DRAWS, marks=pytest.mark.thorough)
"""Sessions. In a few, two that nobody has among what is said with 0.98 to 1 show."""

KEYS = (
    "angle_offset",
    "quadratic",
    "g_sensitivity",
    "bias_drift:acc",
    "temperature_bias:gyr",
)
SESSION = Session.of(ladder(), KEYS, ODDS)
DENSITY = priors.density()


@dataclass(frozen=True)
class Draw:
    """One session drawn from the prior.

    Attributes
    ----------
    true : names of the causes that are there
    value : (k,) of the columns of all groups
    members : causes and groups of the true set
    search : over its rows
    known : the true set, with its true sizes

    """

    true: frozenset[str]
    value: Array
    members: tuple[Member, ...]
    search: Search
    known: Eliminated

    @cached_property
    def best(self) -> Set:
        """The set that is found, where the true one was visited before."""
        _ = self.found
        return self.search.run()

    @cached_property
    def found(self) -> Set:
        """The true set, with sizes that are found."""
        return self.search.sets.evaluate(self.members)

    @cached_property
    def posterior(self) -> Posterior:
        """What is said of it."""
        return Posterior(self.search, self.best)


THREE = np.stack(np.unravel_index(np.arange(len(SIZES) ** 3), (len(SIZES),) * 3), 1)
"""Which sizes the axes of a triad have, all that there are (n, 3)."""


def alike(search: Search) -> list[Array]:
    """Probabilities of the sizes of each triad, by `instability_log_prior`, (n,)."""
    found = []
    for first in (0, 3):
        every = np.zeros((len(THREE), 7))
        every[:, first : first + 3] = THREE
        log = np.asarray(search.sets.instability_log_prior(every))
        found.append(np.exp(log - np.logaddexp.reduce(log)))
    return found


def instabilities(rng: np.random.Generator, shares: list[Array]) -> Array:
    """Draw the sizes of typical instabilities, (7,)."""
    three = [SIZES[THREE[rng.choice(len(THREE), p=share)]] for share in shares]
    return np.concatenate([*three, [0.0]])


@cache
def draws() -> tuple[Draw, ...]:
    d, design, out = SESSION.dictionary, SESSION.design, []
    rng = np.random.default_rng(17)
    empty = SESSION.search(np.zeros((len(d.x), 6)))
    shares = alike(empty)
    for _ in range(DRAWS):
        members = tuple(
            (c, c.variants[rng.integers(len(c.variants))])
            for c in d.causes
            if rng.random() < ODDS / (1 + ODDS)
        )
        groups = [*d.always, *(g for _, g in members)]
        columns = np.concatenate([g.columns for g in groups])
        drawn = [float(rng.choice(SIZES, p=DENSITY)) for _ in groups]
        wide = np.concatenate([
            g.prior_sigma(v if g.fixed_size is None else g.fixed_size)
            for g, v in zip(groups, drawn, strict=True)
        ])  # fmt: skip
        value = wide * rng.standard_normal(len(wide))
        tau = instabilities(rng, shares) * empty.sets.typical_instability
        off = SESSION.noise(rng, tau) + design[:, :, columns] @ value
        search = SESSION.search(off)
        known = Eliminated.of(search.sets.gram.with_instability(tau), columns, wide)
        true = frozenset(c.name for c, _ in members)
        out.append(Draw(true, value, members, search, known))
    return tuple(out)


@cache
def said(count: int) -> tuple[Array, Array]:
    """Probabilities that were said of some sessions, and whether it was so."""
    found = []
    for one in draws()[:count]:
        for standing in one.posterior.probable_causes():
            so = bool(one.true & {standing.name, *standing.aliases})
            found.append((standing.probability, so))
    share, true = zip(*found, strict=True)
    return np.minimum(share, 1.0), np.array(true)


@pytest.mark.parametrize(
    ("low", "high", "count"),
    [
        pytest.param(0.5, 0.9, DRAWS, marks=pytest.mark.thorough),
        pytest.param(0.9, 0.98, DRAWS, marks=pytest.mark.thorough),
        (0.98, 1.01, FEW),
        pytest.param(0.98, 1.01, DRAWS, marks=pytest.mark.thorough),
    ],
)
def test_what_is_said_is_true_as_often_as_is_said(
    low: float, high: float, count: int
) -> None:
    share, so = said(count)
    some = (low <= share) & (share < high)
    assert some.sum() >= 3
    mean = float(share[some].mean())
    told = binomtest(int(so[some].sum()), int(some.sum()), mean)
    assert told.pvalue > 0.01, (so[some].mean(), mean, some.sum())


@pytest.mark.thorough
def test_that_nothing_is_there_is_as_unlikely_as_is_said() -> None:
    """Above one half it is that nothing shows: what is too small may be there."""
    every = [(one.posterior, not one.true) for one in draws()]
    for low, high in ((0.0, 0.01), (0.01, 0.6)):
        some = [
            (p.probability_of_noise_alone, so)
            for p, so in every
            if low <= p.probability_of_noise_alone < high
        ]
        mean = float(np.mean([p for p, _ in some]))
        true = sum(so for _, so in some)
        assert len(some) >= 8
        assert binomtest(true, len(some), min(mean, 1.0)).pvalue > 0.01, (low, mean)


def test_suspects_have_their_probability_and_the_likeliest_is_first() -> None:
    one = draws()[0]
    posterior = Posterior(one.search, one.best)
    suspects = posterior.ranked_causes()
    assert {n for n, _ in suspects} <= {key.split(":")[0] for key in KEYS}
    for name, probability in suspects:
        assert probability == pytest.approx(posterior.probability([name]))
    shares = [p for _, p in suspects]
    assert shares == sorted(shares, reverse=True)
    assert max(shares) <= 1 - posterior.probability_of_noise_alone + 1e-9


@pytest.mark.parametrize("count", [FEW, ALL])
def test_what_is_large_is_said(count: int) -> None:
    """Of causes that the rows show beyond doubt, nearly all."""
    missed, shown = 0, 0
    for one in draws()[:count]:
        state = one.known
        names = {s.name for s in one.posterior.probable_causes()}
        for cause, group in one.found.members:
            at = np.isin(state.columns, group.columns)
            pull = state.estimate[at] / np.sqrt(np.diag(state.inverse)[at])
            if np.abs(pull).max() > 12.0:
                shown += 1
                missed += cause.name not in names
    assert shown > count / 4
    assert missed <= 0.02 * shown


def pulls(state: Eliminated, value: Array) -> Array:
    off: Array = (state.estimate - value) / np.sqrt(np.diag(state.inverse))
    return off


def test_with_known_sizes_estimates_are_as_near_as_they_say() -> None:
    """Every column, and all of a session together."""
    away = np.concatenate([pulls(one.known, one.value) for one in draws()])
    assert 0.93 < np.mean(np.abs(away) < 1.96) < 0.97
    square, freedom = 0.0, 0
    for one in draws():
        root = np.linalg.cholesky(
            one.known.inverse / np.outer(*[one.known.prior_sigma] * 2)
        )
        off = (one.known.estimate - one.value) / one.known.prior_sigma
        square += float(np.sum(np.linalg.solve(root, off) ** 2))
        freedom += len(off)
    assert chi2.ppf(0.005, freedom) < square < chi2.ppf(0.995, freedom)


@pytest.mark.thorough
def test_with_sizes_found_estimates_are_as_near_as_they_say() -> None:
    """Bias and scale factor, whose sizes are found with the instability."""
    away = []
    for one in draws():
        count = sum(len(g.columns) for g in SESSION.dictionary.always)
        state = average_over_sizes(one.search.sets, one.found).state
        away.append(pulls(state, one.value)[:count])
    assert 0.93 < np.mean(np.abs(np.concatenate(away)) < 1.96) < 0.97


def test_what_is_reported_is_the_mean_over_instabilities() -> None:
    one = draws()[1]
    found = average_over_sizes(one.search.sets, one.found)
    wide, _ = with_typical_calibration(SESSION.dictionary, one.found)
    state = Eliminated.of(one.found.state.rows, one.found.state.columns, wide)
    opened = replace(one.found, state=state)
    mixed = Mixing(SESSION.dictionary, one.search.sets.gram, opened,
                   one.search.sets.typical_instability, False).run()  # fmt: skip
    np.testing.assert_allclose(found.state.estimate, mixed.mean)
    np.testing.assert_allclose(found.state.inverse, mixed.covariance)
    half = found.state.half
    np.testing.assert_allclose(half.T @ half, mixed.covariance, rtol=1e-6, atol=1e-18)
    assert found.members == one.found.members and found.score == one.found.score


def test_what_does_the_same_stands_in_its_place() -> None:
    """A drift with the time, and one with a temperature that rises steadily."""
    same = {"bias_drift", "temperature_bias"}
    session = Session.of(
        ladder(),
        ("bias_drift:gyr", "temperature_bias:gyr", "angle_offset", "quadratic"),
    )
    drift = session.dictionary.causes[0].variants[0]
    for seed in range(5):
        rng = np.random.default_rng(seed)
        rise = drift.typical * 0.3 * rng.choice([-1.0, 1.0], 3)
        off = session.noise(rng, session.dictionary.typical_instability)
        search = session.search(off + session.design[:, :, drift.columns] @ rise)
        (found,) = Posterior(search, search.run()).probable_causes()
        assert {found.name, *found.aliases} == same
        assert found.probability > 0.99


def test_probabilities_are_shares_of_the_sets_that_were_visited() -> None:
    one = draws()[0]
    posterior = Posterior(one.search, one.best)
    total = sum(share for _, share in posterior.weights)
    assert total == pytest.approx(1.0)
    (best, share), *_ = sorted(posterior.weights, key=lambda w: -w[1])
    assert best is one.best
    for other, part in posterior.weights:
        assert np.log(part / share) == pytest.approx(other.score - best.score, abs=1e-6)
    with_one = [w for s, w in posterior.weights if KEYS[0] in posterior.cause_names(s)]
    assert posterior.probability([KEYS[0]]) == pytest.approx(sum(with_one))


def test_no_probability_is_above_one_however_large_the_evidence() -> None:
    one = next(d for d in draws() if d.best.members)
    posterior = Posterior(one.search, one.best)
    sets = one.search.sets.visited
    far = {k: replace(s, score=s.score - 123_456.7) for k, s in sets.items()}
    posterior.search = copy(one.search)
    posterior.sets.visited = far
    every = {c.name for s in far.values() for c, _ in s.members}
    said = [posterior.probability([name]) for name in every]
    assert max(said) <= 1.0 and posterior.probability_of_noise_alone <= 1.0
    assert sum(w for _, w in posterior.weights) == pytest.approx(1.0, abs=1e-14)


def test_what_accelerometers_show_stands_for_nothing_on_gyroscopes() -> None:
    d = SESSION.dictionary
    drift = next(c for c in d.causes if c.key == "bias_drift:acc").variants[0]
    there = SESSION.design[:, :, drift.columns] @ drift.prior_sigma(1.0)
    rng = np.random.default_rng(4)
    search = SESSION.search(SESSION.noise(rng, np.zeros(7)) + there)
    posterior = Posterior(search, search.run())
    (one,) = posterior.probable_causes()
    assert (one.name, one.triads) == ("bias_drift", frozenset({"acc"}))
    assert posterior.probability(["bias_drift"], frozenset({"acc"})) > 0.99
    assert posterior.probability(["bias_drift"], frozenset({"gyr"})) < 0.05


@pytest.mark.thorough
def test_a_cause_that_is_not_excluded_counts_though_the_search_left_it_out() -> None:
    """All that come near are tried here, one after the other."""
    session, near = Session.of(ladder(), KEYS), 3.4
    near_ones = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        off = session.noise(rng)
        for cause in session.dictionary.causes:
            group = cause.variants[0]
            size = 0.02 * rng.standard_normal(len(group.columns))
            off += session.design[:, :, group.columns] @ (size * group.typical)
        search = session.search(off)
        best = search.run()
        posterior = Posterior(search, best)
        counts = {s.keys: w for s, w in posterior.weights}
        for cause in session.dictionary.causes:
            if cause.key in best.keys:
                continue
            more = max((session.search(off).sets.evaluate((*best.members, (cause, v)))
                        for v in cause.variants), key=lambda s: s.score)  # fmt: skip
            if more.score > best.score - near:
                near_ones.append(more.keys in counts)
    # beside sizes that fit it, a few are nearer than foretold
    assert len(near_ones) > 8 and np.mean(near_ones) > 0.9


def test_what_no_row_tells_from_the_calibration_is_not_shown() -> None:
    """Gravity is the three scale factors; their usual size alone would tell of it."""
    session = Session.of(ladder(), ("gravity_error", "bias_drift:acc"))
    causes = {c.key: c for c in session.dictionary.causes}
    there = {key: causes[key].variants[0] for key in causes}
    off = session.noise(np.random.default_rng(2), np.zeros(7))
    for group, size in ((there["gravity_error"], 5.0), (there["bias_drift:acc"], 1.0)):
        off += session.design[:, :, group.columns] @ (size * group.typical)
    search = session.search(off)
    shown = search.offers.shown_in_addition(search.sets.evaluate(()))
    assert not shown(there["gravity_error"]) and shown(there["bias_drift:acc"])
