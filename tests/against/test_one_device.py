"""A cause beside scale factors that two recordings of one device have alike.

A wrong gravity moves the scale factors of all axes. One recording alone hardly tells it
from three odd scale factors; another recording of the same device tells them apart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from fieldcal.against.causes import EQUAL
from fieldcal.against.joint import (
    DIFFERS,
    MODELLED,
    EffectInformation,
    Relation,
    probability_of_differing,
    relation_probabilities,
)
from fieldcal.against.one_device import (
    GroupBesideEffect,
    SideOfDevice,
    evidence_of_one_device,
)
from fieldcal.core.samples import Array
from fieldcal.model import priors

AXES, SIGMA, SCALE, GRAVITY, CHANCE = 3, 1e-4, 1e-2, 1e-3, 0.01
"""Axes; sigma of a row, and prior sigmas of scale factors and of gravity, all
relative; how often a recording has a wrong gravity."""

COMMON = np.ones((AXES, 1))
SHARES = priors.density()


@dataclass(frozen=True)
class Side:
    """One recording: a row for each scale factor."""

    rows: Array

    def group(self) -> GroupBesideEffect:
        """Scale factors, by conditioning dense Gaussians."""
        gain = SCALE**2 * np.linalg.inv((SIGMA**2 + SCALE**2) * np.eye(AXES))
        return GroupBesideEffect(
            gain @ self.rows,
            SCALE**2 * (np.eye(AXES) - gain),
            gain @ COMMON * GRAVITY,
            np.zeros((AXES, AXES)),
            np.full(AXES, SCALE),
        )

    def information(self) -> EffectInformation:
        """Of gravity, with the scale factors eliminated."""
        inverse = np.linalg.inv((SIGMA**2 + SCALE**2) * np.eye(AXES))
        typical = COMMON * GRAVITY
        return EffectInformation(
            typical.T @ inverse @ typical,
            typical.T @ inverse @ self.rows,
            float(AXES * GRAVITY**2 / SIGMA**2),
        )


def log_normal(y: Array, cov: Array) -> float:
    return -0.5 * float(y @ np.linalg.solve(cov, y) + np.linalg.slogdet(cov)[1])


def dense_odds(real: Side, sim: Side, of: Relation) -> float:
    """ln of the odds of a relation and of no wrong gravity, over all of its sizes."""
    y = np.concatenate([real.rows, sim.rows])
    one = np.ones((2 * AXES, 1))
    alike = np.kron(np.ones((2, 2)), np.eye(AXES)) * SCALE**2
    white = SIGMA**2 * np.eye(2 * AXES)
    apart = np.kron(np.diag([0.0, 1.0]), np.eye(AXES))

    def given(gravity: Array) -> float:
        same = log_normal(y, white + alike + gravity)
        other = [
            log_normal(y, white + alike + gravity + (v * SCALE) ** 2 * apart)
            for v in priors.SIZES
        ]
        differing = np.logaddexp.reduce(np.log(SHARES) + other)
        return float(
            np.logaddexp(np.log1p(-DIFFERS) + same, np.log(DIFFERS) + differing)
        )

    where = one.copy()
    where[AXES:] = 0.0
    if of == "simulator":
        where = one - where
    sizes = [given((v * GRAVITY) ** 2 * where @ where.T) for v in priors.SIZES]
    has = float(np.logaddexp.reduce(np.log(SHARES) + sizes))
    prior = np.log(CHANCE * (1 - MODELLED)) - np.log1p(-CHANCE)
    return float(has + prior - given(np.zeros((2 * AXES, 2 * AXES))))


def of_one_device(real: Side, sim: Side, differs: float) -> dict[Relation, float]:
    ours, theirs = (SideOfDevice([s.group()], s.information()) for s in (real, sim))
    return evidence_of_one_device(ours, theirs, random=False, differs=differs)


def drawn(seed: int, gravity: tuple[float, float]) -> tuple[Side, Side]:
    rng = np.random.default_rng(seed)
    scale = SCALE * rng.standard_normal(AXES)
    real, sim = (
        Side(scale + off + SIGMA * rng.standard_normal(AXES)) for off in gravity
    )
    return real, sim


def relations(real: Side, sim: Side) -> dict[Relation, float]:
    return relation_probabilities(
        real.information(), sim.information(), CHANCE, None, None,
        of_one_device(real, sim, DIFFERS),
    )  # fmt: skip


def nothing_differs(real: Side, sim: Side) -> float:
    """Probability that neither gravity nor scale factors differ."""
    found, equal = relations(real, sim), of_one_device(real, sim, 0.0)
    some = of_one_device(real, sim, DIFFERS)
    return sum(found[n] * float(np.exp(equal[n] - some[n])) for n in EQUAL)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("gravity", [(1.5e-3, 0.0), (0.0, -1.5e-3), (5e-4, 0.0)])
def test_evidence_is_that_of_dense_gaussians(
    seed: int, gravity: tuple[float, float]
) -> None:
    real, sim = drawn(seed, gravity)
    found = relations(real, sim)
    for of in ("real", "simulator"):
        odds = np.log(found[of] / found["neither"])
        assert odds == pytest.approx(dense_odds(real, sim, of), abs=0.5)


@pytest.mark.parametrize("seed", range(6))
def test_a_wrong_gravity_is_told_by_the_scale_factors_of_the_other(seed: int) -> None:
    real, sim = drawn(seed, (1.5e-3, 0.0))
    alone = relation_probabilities(
        real.information(), sim.information(), CHANCE, None, None
    )
    assert probability_of_differing(alone) < 0.05, "its scale factors may be any"
    assert probability_of_differing(relations(real, sim)) > 0.6
    assert nothing_differs(real, sim) < 1e-6


def test_scale_factors_of_two_devices_are_no_wrong_gravity() -> None:
    """Three differences of their own are likelier than a common one that is not."""
    rng = np.random.default_rng(3)
    real, sim = (Side(SCALE * rng.standard_normal(AXES)) for _ in range(2))
    assert probability_of_differing(relations(real, sim)) < 0.05
    assert nothing_differs(real, sim) < 1e-6


def test_equal_recordings_have_no_wrong_gravity() -> None:
    for seed in range(20):
        pair = drawn(seed, (0.0, 0.0))
        assert probability_of_differing(relations(*pair)) < 0.05
        assert nothing_differs(*pair) > 0.8


def test_a_random_effect_that_wanders_is_in_the_difference_of_biases() -> None:
    """A walk of which the rest shows nothing: the biases of both tell its size."""
    wide = np.eye(1)
    told = EffectInformation(np.zeros((1, 1)), np.zeros(1), 0.0)

    def side(value: float, wander: float) -> SideOfDevice:
        group = GroupBesideEffect(
            np.array([value]), 1e-4 * wide, np.zeros((1, 1)), wander * wide,
            np.ones(1),
        )  # fmt: skip
        return SideOfDevice([group], told)

    near, far = (
        evidence_of_one_device(side(off, 1e-2), side(0.0, 1e-2), random=True, differs=0)
        for off in (0.0, 0.3)
    )
    for name in ("real", "simulator", "same", "other"):
        assert near[name] < near["neither"] and far[name] > far["neither"]
    true = log_normal(np.array([0.3]), 1.02e-2 * np.eye(1))
    less = log_normal(np.array([0.3]), 2e-4 * np.eye(1))
    assert far["real"] - far["neither"] == pytest.approx(true - less, abs=1e-9)


def test_instability_that_an_effect_explains_goes_from_both_recordings() -> None:
    """Left out, it is taken for instability of the biases, in either recording."""
    explained, own = 1e-2, 1e-3
    told = EffectInformation(1e4 * np.eye(1), np.full(1, 1e4), 1e4)
    group = GroupBesideEffect(
        np.zeros(1), (own + explained) * np.eye(1), np.zeros((1, 1)),
        -explained * np.eye(1), np.ones(1),
    )  # fmt: skip
    side = SideOfDevice([group], told)
    found = evidence_of_one_device(side, side, random=False, differs=0)
    density = 0.5 * np.log((own + explained) / own)
    assert found["same"] - found["neither"] == pytest.approx(density, abs=1e-9)
    assert found["other"] - found["neither"] == pytest.approx(density, abs=1e-9)
