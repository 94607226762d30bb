"""Parameters that a turn of the whole device changes into each other."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fieldcal.diagnosis.findings.found_effects import merge_turned_parameters
from fieldcal.diagnosis.result import Quantity
from fieldcal.effects import catalogue
from fieldcal.model.causes.cause import Group

EFFECT = catalogue()["cross_coupling"]
NAMES = [p.name for p in EFFECT.params]  # k12 k13 k21 k23 k31 k32
PRIOR = 0.02


def merged(taken: tuple[str, ...], covariance: np.ndarray[Any, Any]) -> Any:
    """What is told of the parameters that a search took, each 0.001 times its place."""
    at = tuple(NAMES.index(name) for name in taken)
    columns = np.arange(len(at))
    group = Group(EFFECT.id, "", columns, np.ones(len(at)), EFFECT, params=at)
    value = 1e-3 * (np.array(at) + 1)
    sigma = np.sqrt(np.diag(covariance))
    own = {
        name: Quantity(v, s, "1")
        for name, v, s in zip(taken, value.tolist(), sigma.tolist(), strict=True)
        if s < 0.5 * PRIOR
    }
    prior = np.full(len(at), PRIOR)
    return merge_turned_parameters(group, value, covariance, prior, own)


def test_where_the_sum_alone_is_determined_it_takes_the_place_of_both() -> None:
    wide, sum_variance = PRIOR**2 / 2, 1e-8
    opposite = (sum_variance - 2 * wide) / 2
    out = merged(("k23", "k32"), np.array([[wide, opposite], [opposite, wide]]))
    assert list(out) == ["k23"]
    assert out["k23"].value == pytest.approx(0.004 + 0.006)
    assert out["k23"].sigma == pytest.approx(1e-4)


def test_where_one_of_both_was_taken_it_is_the_sum() -> None:
    """Whichever of them it is called: they are in the order of the effect."""
    out = merged(("k13", "k21", "k32"), np.diag([1e-8, 4e-8, 9e-8]))
    assert list(out) == ["k12", "k13", "k23"]
    assert [one.value for one in out.values()] == [0.003, 0.002, 0.006]
    assert [one.sigma for one in out.values()] == pytest.approx([2e-4, 1e-4, 3e-4])


def test_where_both_are_determined_they_are_told_apart() -> None:
    out = merged(("k12", "k21"), np.diag([1e-8, 1e-8]))
    assert list(out) == ["k12", "k21"]
