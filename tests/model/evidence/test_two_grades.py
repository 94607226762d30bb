"""Which of two sizes a kind of error has, against evidence by dense rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from gram_cases import TAU, case
from observed import observe

from fieldcal.core.factory import FactoryErrors
from fieldcal.core.positions import TWO_POSITIONS, Position, specific_forces
from fieldcal.model import priors
from fieldcal.model.causes.cause import Group
from fieldcal.model.evidence.gram import Eliminated
from fieldcal.model.evidence.two_grades import chances_of_coarser
from fieldcal.solve import solve

SET = np.array([0, 3, 4, 7])
SIZES = np.array([0.7, 2.0, 1.0, 0.5])
COARSER = FactoryErrors(1e-2, 2.5e-4, 9e-5, hysteresis=5e-3)
STATED = FactoryErrors(1e-3, 2e-5, 9e-5, hysteresis=5e-4)
G = 9.81
MANY = tuple(Position.deg(a, b) for a in (-60, -20, 20, 60, 120) for b in (-60, 0, 45))


def group(part: str, *columns: int) -> Group:
    return Group(
        "factory", part, np.array(columns), np.ones(len(columns)), fixed_size=1.0
    )


@pytest.mark.parametrize("seed", range(3))
def test_the_chance_is_that_of_both_sizes_by_dense_rows(seed: int) -> None:
    """A kink and K2 have one size; a kind that both grades have alike is not told."""
    one = case(seed)
    state = Eliminated.of(one.gram.with_instability(TAU), SET, SIZES)
    groups = [group("cross_coupling", 0), group("quadratic", 3),
              group("scale_asymmetry", 4), group("g_sensitivity", 7)]  # fmt: skip
    chances = chances_of_coarser(state, groups, COARSER, STATED)
    assert chances.keys() == {"cross_coupling", "quadratic"}
    full = one.dense.evidence(SET, SIZES)
    for kind, part, at in (("cross_coupling", 0.1, [0]), ("quadratic", 0.08, [1, 2])):
        less = SIZES.copy()
        less[at] *= part
        ahead = full - one.dense.evidence(SET, less)
        odds = np.exp(ahead) * (1 - priors.AS_STATED_CHANCE) / priors.AS_STATED_CHANCE
        assert chances[kind] == pytest.approx(odds / (1 + odds), rel=1e-6)


def test_each_triad_warms_up_by_its_own() -> None:
    one = case(1)
    state = Eliminated.of(one.gram.with_instability(TAU), SET, SIZES)
    warming = replace(group("warm_up", 0, 3, 4, 7), params=(0, 1, 3, 5))
    coarser = FactoryErrors(acc_per_k=4e-3, gyr_per_k=5e-4)
    stated = FactoryErrors(acc_per_k=4e-4, gyr_per_k=5e-4)
    chances = chances_of_coarser(state, [warming], coarser, stated)
    less = SIZES * [0.1, 0.1, 1.0, 1.0]
    ahead = one.dense.evidence(SET, SIZES) - one.dense.evidence(SET, less)
    odds = np.exp(ahead) * (1 - priors.AS_STATED_CHANCE) / priors.AS_STATED_CHANCE
    assert chances == pytest.approx({"acc_per_k": odds / (1 + odds)}, rel=1e-6)


@pytest.mark.parametrize(
    ("k2", "size"), [(0.0, STATED.quadratic), (3e-4, COARSER.quadratic)]
)
def test_many_positions_tell_how_straight_a_device_is(k2: float, size: float) -> None:
    force = specific_forces(MANY, G)
    seen = observe(MANY, force + k2 * force**2, sigma=1e-4)
    found = solve(seen, cross=True, factory=COARSER, at_best=STATED)
    assert found.info["quadratic_sigma"] == size
    value, sigma = found.vector("acc_scale")
    assert np.abs((value - 1) / sigma).max() < 3


def test_two_positions_tell_nothing_and_the_coarser_grade_stays() -> None:
    seen = observe(TWO_POSITIONS, specific_forces(TWO_POSITIONS, G), sigma=1e-4)
    found = solve(seen, factory=COARSER, at_best=STATED)
    assert found.info["quadratic_sigma"] == COARSER.quadratic
    alone = solve(seen, factory=COARSER)
    np.testing.assert_allclose(found.covariance, alone.covariance)
