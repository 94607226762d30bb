"""Offsets in one proportion: found as one group, and not where axes scatter alone."""

from __future__ import annotations

import numpy as np
import pytest
from small_sessions import LADDER, SD, dictionary, ladder, nominal, rows_of

from fieldcal.core.samples import Array
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.evidence.sets import Sets
from fieldcal.model.search.proportional_offsets import proportional_causes
from fieldcal.model.system.linear_system import gram
from fieldcal.model.system.window_rows import WindowSystem

X = ladder()


def searched(off: Array, d: Dictionary) -> Sets:
    y = np.hstack([X.f, X.w]) + off
    linear = WindowSystem(rows_of(X, y), d).linearised(nominal())
    return Sets(d, gram(linear, d, np.zeros(d.width)))


def noisy(seed: int) -> tuple[Array, np.random.Generator]:
    rng = np.random.default_rng(seed)
    return SD * rng.standard_normal((len(X), 6)), rng


def risen(off: Array, part: str) -> float:
    """By how much the group of one proportion raises the weight of nothing, ln."""
    d = dictionary(X)
    d.add_causes(list(proportional_causes(d, [searched(off, d).evaluate(())])))
    sets = searched(off, d)
    (cause,) = (c for c in d.causes if c.key == f"position:{part}")
    there = sets.evaluate(((cause, cause.variants[0]),))
    return there.score - sets.evaluate(()).score


@pytest.mark.parametrize("proportion", [(2e-2, -1.5e-2, 1e-2), (0.0, 0.0, 2e-2)])
def test_one_proportion_needs_fewer_numbers_than_axes_that_scatter(
    proportion: tuple[float, float, float],
) -> None:
    off, rng = noisy(1)
    course = rng.standard_normal(len(LADDER))[X.position]
    off[:, :3] += course[:, None] * proportion
    assert risen(off, "acc") > 20.0
    assert risen(off, "gyr") < 0.0


@pytest.mark.parametrize(
    "scatter",
    [1e-3, *(pytest.param(s, marks=pytest.mark.thorough) for s in (0.0, 1e-2))],
)
def test_axes_that_scatter_each_for_itself_have_no_proportion(scatter: float) -> None:
    for seed in range(5):
        off, rng = noisy(seed)
        each = rng.standard_normal((len(LADDER), 3))[X.position]
        off[:, :3] += scatter * each
        assert risen(off, "acc") < 0.0


def test_columns_are_the_derivatives_of_the_product() -> None:
    """(1) by differences, about what the rows themselves say."""
    off, rng = noisy(3)
    course = rng.standard_normal(len(LADDER))
    off[:, :3] += course[X.position, None] * [3e-2, -2e-2, 1e-2]
    d = dictionary(X)
    acc, gyr = proportional_causes(d, [searched(off, d).evaluate(())])
    d.add_causes([acc, gyr])
    group = acc.variants[0]
    linear = WindowSystem(rows_of(X, np.hstack([X.f, X.w])), d).linearised(nominal())
    design = np.zeros((len(X), 3, len(group.columns)))
    for part in linear[:3]:
        whole = np.zeros((len(X), d.width))
        whole[:, part.columns] = part.design / part.weight[:, None]
        design[:, part.channel] = whole[:, group.columns]
    main, across = design[:, :, : len(LADDER)], design[:, :, len(LADDER) :]
    a0 = main[X.position == 0][0, :, 0]
    assert abs(a0 @ [3, -2, 1]) / np.linalg.norm(a0) == pytest.approx(14**0.5, rel=1e-3)
    assert np.abs(np.einsum("c,nck->nk", a0, across)).max() < 1e-12
    d0 = np.einsum("c,nck->nk", across[0, :, 0], across)[:, 0]
    apart = np.corrcoef(d0, course[X.position])[0, 1]
    assert abs(apart) > 0.99
