"""Which of two sizes a kind of error has, against evidence by dense rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from gram_cases import TAU, case

from fieldcal.core.factory import FactoryErrors
from fieldcal.model import priors
from fieldcal.model.causes.cause import Group
from fieldcal.model.evidence.eliminated import Eliminated
from fieldcal.model.evidence.unfitted_groups import chances_of_coarser

SET = np.array([0, 3, 4, 7])
SIZES = np.array([0.7, 2.0, 1.0, 0.5])
COARSER = FactoryErrors(1e-2, 2.5e-4, 9e-5, hysteresis=5e-3)
STATED = FactoryErrors(1e-3, 2e-5, 9e-5, hysteresis=5e-4)


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
