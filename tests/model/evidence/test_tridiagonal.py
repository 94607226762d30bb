"""Gains of wide groups, against determinants and inverses that are written out."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import Array
from fieldcal.model.evidence.eliminated import (
    evidence_gains,
    gains_from_eigenvalues,
    group_directions,
    noticeable_gains,
)
from fieldcal.model.evidence.tridiagonal import is_wide, tridiagonal_gains
from fieldcal.model.priors import SIZES


def groups(seed: int, shape: tuple[int, ...], rank: int) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(*shape, rank)) * np.exp(rng.uniform(-3, 3, rank))
    rhs = (root @ rng.normal(2.0, 2.0, (*shape[:-1], rank, 1)))[..., 0]
    return root @ np.swapaxes(root, -1, -2), rhs


def written_out(inner: Array, rhs: Array, square: Array) -> Array:
    """[v^2 q^T (I + v^2 M)^-1 q - ln |I + v^2 M|] / 2 of one group."""
    out = []
    for v2 in square:
        whole = np.eye(len(rhs)) + v2 * inner
        explained = v2 * rhs @ np.linalg.solve(whole, rhs)
        out.append(0.5 * (explained - np.linalg.slogdet(whole)[1]))
    return np.array(out)


@pytest.mark.parametrize("width", [1, 2, 9, 24, 61])
def test_gains_are_those_of_the_whole_matrix(width: int) -> None:
    inner, rhs = groups(width, (2, 3, width), width + 2)
    found = tridiagonal_gains(inner, rhs)
    assert found.shape == (2, 3, len(SIZES))
    for at in np.ndindex(2, 3):
        expected = written_out(inner[at], rhs[at], SIZES**2)
        np.testing.assert_allclose(found[at], expected, rtol=1e-8, atol=1e-8)


def test_a_variance_that_is_taken_away_counts_too() -> None:
    """At each group's own v^2, of which some are below zero."""
    inner, rhs = groups(7, (2, 12), 20)
    most = 1 / np.linalg.eigvalsh(inner).max(axis=1)
    square = np.array([-0.9, -0.2, 0.0, 3.0]) * most[:, None]
    found = tridiagonal_gains(inner, rhs, square, 1e-14)
    for one in range(2):
        expected = written_out(inner[one], rhs[one], square[one])
        np.testing.assert_allclose(found[one], expected, rtol=1e-8, atol=1e-8)


def test_directions_that_rows_do_not_determine_gain_nothing() -> None:
    """Rounding errors of 1e-16 of the largest element are below -1 at the size 1e3."""
    inner, rhs = groups(3, (1, 30), 4)
    inner *= 1e8
    rhs *= 1e4
    size, along = np.linalg.eigh(inner[0])
    strength, power = size[-4:], (along[:, -4:].T @ rhs[0]) ** 2
    square = SIZES[:, None] ** 2
    ratio = square * strength
    expected = 0.5 * (square * power / (1 + ratio) - np.log1p(ratio)).sum(axis=1)
    found, likely = tridiagonal_gains(inner, rhs)[0], expected > expected.max() - 30
    np.testing.assert_allclose(found, expected, atol=1.0)
    np.testing.assert_allclose(found[likely], expected[likely], atol=1e-2)


@pytest.mark.parametrize("width", [3, 40])
def test_groups_that_reach_what_is_asked_are_told_however_wide(width: int) -> None:
    inner, rhs = groups(5, (4, 6, width), 2 * width)
    rhs *= np.linspace(0.05, 1.0, 6)[:, None]
    own = np.diagonal(inner, 0, 2, 3).max(axis=-1)
    every = gains_from_eigenvalues(*group_directions(inner, rhs, own))
    least = np.linspace(0.5, 2.0, 6)
    level, number, gain = noticeable_gains(inner, rhs, own, least)
    assert is_wide(rhs) == (width == 40)
    np.testing.assert_allclose(gain, every[level, number], rtol=1e-7, atol=1e-7)
    told = np.zeros((4, 6), dtype=bool)
    told[level, number] = True
    assert told[every.max(axis=-1) >= least].all()
    np.testing.assert_allclose(evidence_gains(inner, rhs, own), every, atol=1e-6)
