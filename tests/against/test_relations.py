"""Evidence of one effect in two sessions, against dense Gaussian densities."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from fieldcal.against.causes import DecidedCauses, aliases_of
from fieldcal.against.joint import (
    MODELLED,
    RESIZED,
    EffectInformation,
    Relation,
    evidence_of_proportional,
    evidence_of_same,
    evidence_of_same_size,
    likeliest_difference,
    probability_of_difference,
    probability_of_differing,
    relation_probabilities,
)
from fieldcal.against.prediction import chi2_of_uncertain_prediction
from fieldcal.against.side import sample_noise
from fieldcal.core.samples import Array, Block
from fieldcal.model import priors
from fieldcal.session import description_file

SIGMA = 0.01
SHARE = priors.density()


def rows(value: Array, seed: int) -> tuple[Array, Array]:
    """A design and rows that show an effect of some size."""
    rng = np.random.default_rng(seed)
    design = rng.normal(0, 1, (30, len(value)))
    return design, design @ value + SIGMA * rng.standard_normal(30)


def told(design: Array, y: Array) -> EffectInformation:
    inner = design.T @ design / SIGMA**2
    return EffectInformation(
        inner, design.T @ y / SIGMA**2, float(np.diag(inner).max())
    )


def density(design: Array, y: Array, v: float) -> float:
    """ln of how likely rows are with an effect of size v, over that without it."""
    out = 0.0
    for size, sign in ((v, 1.0), (0.0, -1.0)):
        cov = SIGMA**2 * np.eye(len(y)) + size**2 * design @ design.T
        square = y @ np.linalg.solve(cov, y)
        out -= sign * 0.5 * float(square + np.linalg.slogdet(cov)[1])
    return out


def over_sizes(values: list[float]) -> float:
    return float(np.log(np.sum(SHARE * np.exp(np.array(values)))))


def about(size: float, values: list[float]) -> float:
    """Over sizes that are normal in ln about one of them, by `RESIZED`."""
    share = stats.norm.pdf(np.log(priors.SIZES), np.log(size), np.log(RESIZED))
    return float(np.log(np.sum(share / share.sum() * np.exp(np.array(values)))))


REAL, SIM = rows(np.array([0.02, -0.01]), 1), rows(np.array([0.015, 0.0]), 2)


def test_the_aliases_of_an_effect_are_those_of_all_recordings_that_have_it() -> None:
    """An effect is no alias of itself, and a tilt of the simulator is named."""

    def diagnosed(**alternatives: tuple[str, ...]) -> Any:
        known = {n: dict.fromkeys(a) for n, a in alternatives.items()}
        posterior = SimpleNamespace(alternatives=known)
        return SimpleNamespace(explanation=SimpleNamespace(posterior=posterior))

    real = diagnosed(scale_asymmetry=("quadratic", "cross_coupling"))
    sim = diagnosed(cross_coupling=("base_tilt", "position"))
    instead = {"cross_coupling": "scale_asymmetry"}
    both = aliases_of("cross_coupling", [real, sim], instead)
    assert both == ("scale_asymmetry", "quadratic", "base_tilt")
    assert aliases_of("cross_coupling", [sim], instead) == ("base_tilt",)
    assert aliases_of("hum", [real, sim], {}) == ()


def test_only_what_both_could_show_is_compared() -> None:
    def side(**told: EffectInformation) -> Any:
        return SimpleNamespace(effect_information=told.get)

    inner = np.zeros((2, 2))
    blind = EffectInformation(inner, np.zeros(2), 0.0)
    real, sim = (
        side(tilt=told(*REAL), g=told(*REAL), hum=told(*REAL)),
        side(tilt=told(*SIM), g=blind),
    )
    pairing: Any = SimpleNamespace(widened=(real, sim))
    found = DecidedCauses(pairing, {}, real, sim)
    assert [found.both_show(key) for key in ("tilt", "g", "hum")] == [
        True,
        False,
        False,
    ]


def test_the_same_effect_in_both_is_that_of_all_rows_together() -> None:
    design, y = np.vstack([REAL[0], SIM[0]]), np.concatenate([REAL[1], SIM[1]])
    expected = over_sizes([density(design, y, v) for v in priors.SIZES])
    assert evidence_of_same(told(*REAL), told(*SIM)) == pytest.approx(
        expected, rel=1e-9
    )


def test_what_is_random_shares_its_size_alone() -> None:
    expected = over_sizes([density(*REAL, v) + density(*SIM, v) for v in priors.SIZES])
    assert evidence_of_same_size(told(*REAL), told(*SIM)) == pytest.approx(
        expected, rel=1e-9
    )


@pytest.mark.parametrize(
    ("real", "sim", "expected"),
    [
        ((0.05, 0.0), (0.0, 0.0), "real"),
        ((0.0, 0.0), (0.05, -0.05), "simulator"),
        ((0.05, 0.0), (0.1, 0.0), "other"),
    ],
)
def test_who_has_it(
    real: tuple[float, float], sim: tuple[float, float], expected: str
) -> None:
    one, two = told(*rows(np.array(real), 3)), told(*rows(np.array(sim), 4))
    found = relation_probabilities(one, two, 0.01, None)
    assert sum(found.values()) == pytest.approx(1.0)
    assert (
        probability_of_differing(found) > 0.99
        and likeliest_difference(found) == expected
    )


def test_the_same_too_weak_is_one_number_along_what_the_other_shows() -> None:
    course = np.linalg.solve(
        np.eye(2) + REAL[0].T @ REAL[0] / SIGMA**2, REAL[0].T @ REAL[1] / SIGMA**2
    )
    column = (SIM[0] @ course / np.linalg.norm(course))[:, None]
    sizes = priors.SIZES
    length = float(np.linalg.norm(course))
    expected = over_sizes([density(*REAL, v) for v in sizes]) + about(
        length, [density(column, SIM[1], v) for v in sizes]
    )
    for pair in ((told(*REAL), told(*SIM)), (told(*SIM), told(*REAL))):
        assert evidence_of_proportional(*pair) == pytest.approx(expected, rel=1e-9)


def test_effects_of_other_sizes_are_of_about_one_size() -> None:
    """The sum over both sizes, of dense densities."""
    found = relation_probabilities(told(*REAL), told(*SIM), 0.01, None)
    sim = [density(*SIM, w) for w in priors.SIZES]
    both = [density(*REAL, v) + about(v, sim) for v in priors.SIZES]
    alone = over_sizes([density(*REAL, v) for v in priors.SIZES])
    odds = 0.5 * MODELLED / (1 - MODELLED) * np.exp(over_sizes(both) - alone)
    assert found["other"] / found["real"] == pytest.approx(odds, rel=1e-8)


def test_what_a_simulator_has_a_hundredth_of_is_left_out() -> None:
    """Nobody could tell it from nothing; of a third it is clear that both have it."""
    of: tuple[tuple[float, Relation], ...]
    of = ((0.0, "real"), (0.01, "real"), (0.3, "other"))
    for share, expected in of:
        shares = []
        for seed in range(10):
            one = told(*rows(np.array([0.3, -0.2]), seed))
            two = told(*rows(share * np.array([0.3, -0.2]), 100 + seed))
            scaled = evidence_of_proportional(one, two)
            found = relation_probabilities(one, two, 0.01, None, scaled)
            shares.append(dict(found)[expected])
        assert np.mean(shares) > 0.9


def test_a_simulator_that_has_some_of_it_is_told_from_one_without() -> None:
    """Of twelve parameters, each by itself would show nothing."""
    rng, value = np.random.default_rng(11), 0.02 * np.ones(12)
    counts = {}
    for share in (0.0, 0.3):
        found: list[list[str]] = [[], []]
        for seed in range(20):
            design = rng.normal(0, 0.3, (30, 12))
            y = share * design @ value + SIGMA * rng.standard_normal(30)
            one, two = told(*rows(value, seed)), told(design, y)
            for out, scaled in zip(
                found, (None, evidence_of_proportional(one, two)), strict=True
            ):
                out.append(
                    likeliest_difference(
                        relation_probabilities(one, two, 0.01, None, scaled)
                    )
                )
        counts[share] = [out.count("other") for out in found]
    assert counts[0.0][1] <= 2, "chance"
    assert counts[0.3][1] >= 14 and counts[0.3][1] >= counts[0.3][0] + 8


def test_what_a_simulator_does_not_know_is_no_misfit() -> None:
    """Beside the dense covariance of what it predicts."""
    rng = np.random.default_rng(8)
    design, r = rng.normal(size=(30, 4)), rng.normal(size=30)
    root = rng.normal(size=(4, 4)) * [1.0, 1e-3, 10.0, 0.1]
    covariance = root.T @ root
    white = np.exp(rng.normal(size=30))
    expected = r @ np.linalg.solve(np.diag(white) + design @ covariance @ design.T, r)
    scaled = design.T / white
    found = chi2_of_uncertain_prediction(
        float(r @ (r / white)), scaled @ r, scaled @ design, covariance
    )
    assert found == pytest.approx(expected, rel=1e-9)


def test_the_noise_of_a_window_is_known_as_well_as_is_said() -> None:
    about = description_file.parse_description(
        {"format": 1, "position": [{"start_s": 0.0, "end_s": 2.0}]}
    )
    rng, seen = np.random.default_rng(9), []
    for _ in range(60):
        six = rng.standard_normal((201, 6))
        level, unsure = sample_noise(
            Block.of(np.arange(201) / 100, *np.split(six, 2, 1)), about
        )
        seen.append(np.log(level) / unsure)
    assert np.std(seen) == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize("size", [0.0, 0.05])
def test_equal_pairs_do_not_differ(size: float) -> None:
    for seed in range(20):
        value = np.array([size, -size])
        one, two = (told(*rows(value, 100 * k + seed)) for k in (1, 2))
        assert (
            probability_of_differing(relation_probabilities(one, two, 0.01, None)) < 0.5
        )


def test_what_a_session_cannot_have_is_the_others_alone() -> None:
    found = relation_probabilities(
        told(*rows(np.array([0.05, 0.0]), 5)), None, 0.01, None
    )
    assert found["real"] > 0.99 and set(found) == {"neither", "real"}


def test_a_difference_counts_by_its_sigmas_and_not_by_its_unit() -> None:
    cov, typical = np.diag([1e-4, 4e-4, 1e-4]), np.full(3, 0.3)
    chances = [
        probability_of_difference(k * np.sqrt(np.diag(cov)), cov, typical)
        for k in (0.0, 1.0, 4.0, 8.0)
    ]
    assert chances == sorted(chances)
    assert chances[1] < 0.05 < 0.95 < chances[3]
    mg = probability_of_difference(
        8e3 * np.sqrt(np.diag(cov)), 1e6 * cov, 1e3 * typical
    )
    assert mg == pytest.approx(chances[3])
