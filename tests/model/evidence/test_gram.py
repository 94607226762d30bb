"""Evidence from a Gram matrix, against rows whose covariance is written out."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from gram_cases import TAU, WIDTH, case
from scipy.linalg import block_diag

from fieldcal.core.samples import Array
from fieldcal.model.causes.cause import CLOSURE
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.causes.known_rows import KnownRows
from fieldcal.model.evidence.eliminated import (
    Eliminated,
    evidence_gains,
    gains_from_eigenvalues,
    largest_gains,
)
from fieldcal.model.evidence.weighted_columns import SplitColumns, WeightedColumns
from fieldcal.model.priors import SIZES
from fieldcal.model.system.linear_system import gram

FREE = pytest.mark.parametrize("free", [(), (1, 3)], ids=["set", "loose"])
SEEDS = pytest.mark.parametrize("seed", range(4))


def assert_agree(found: Array, expected: Array) -> None:
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-11)


SET = np.array([0, 3, 4, 7])
WIDE = np.array([0.7, 2.0, 0.05, 1.0])


@SEEDS
@FREE
def test_information_is_that_of_the_rows(seed: int, free: tuple[int, ...]) -> None:
    one = case(seed, free)
    rows, every = one.gram.with_instability(TAU), np.arange(WIDTH)
    inner, rhs = one.dense.information()
    assert_agree(rows.matrix(every, every), inner[:WIDTH, :WIDTH])
    blocks = [np.array([[0, 1], [5, 2]]), np.array([[8]])]
    columns = WeightedColumns(SplitColumns(one.gram, blocks), rows)
    assert_agree(columns.beside(SET, one.gram.within.rows(SET)), inner[SET])
    assert_agree(rows.rhs(SET), rhs[SET])
    assert_agree(columns.rhs, rhs)
    for at, found in zip(blocks, columns.blocks, strict=True):
        for block, there in zip(at, found, strict=True):
            assert_agree(there, inner[np.ix_(block, block)])


@SEEDS
@FREE
def test_known_columns_are_taken_off_the_rows(seed: int, free: tuple[int, ...]) -> None:
    one = case(seed, free)
    known, values = np.array([6, 2]), np.array([0.8, -1.7])
    left = replace(one.dense, y=one.dense.y - one.dense.design[:, known] @ values)
    rows = one.gram.with_known(known, values).with_instability(TAU)
    assert_agree(rows.rhs(SET), left.information()[1][SET])
    square = left.y @ np.linalg.solve(left.cov, left.y)
    assert rows.square == pytest.approx(square, rel=1e-9)


@SEEDS
@FREE
def test_squares_and_determinant_are_those_of_the_rows(
    seed: int, free: tuple[int, ...]
) -> None:
    one = case(seed, free)
    rows, dense = one.gram.with_instability(TAU), one.dense
    square = dense.y @ np.linalg.solve(dense.cov, dense.y)
    assert rows.square == pytest.approx(square, rel=1e-9)
    log_det = np.linalg.slogdet(dense.cov)[1] - 2 * np.log(dense.white).sum()
    assert rows.log_det == pytest.approx(log_det, rel=1e-9)


@SEEDS
@FREE
def test_each_mean_has_the_information_that_the_rest_of_its_window_leaves(
    seed: int, free: tuple[int, ...]
) -> None:
    one = case(seed, free).gram
    for p, weight in enumerate(one.with_instability(TAU).weight):
        there = one.info[p] > 0
        cov = one.free_rotations[p][there] @ one.free_rotations[p][there].T
        spread = one.shared[p] ** 2 + TAU[one.kind[p]] ** 2
        spread += one.closure_errors[p] ** 2 @ TAU[:6] ** 2
        cov += np.diag(1 / one.info[p][there] + spread[there])
        assert_agree(weight[there], np.diag(np.linalg.inv(cov)))
        assert not weight[~there].any()


@SEEDS
@FREE
def test_evidence_and_estimates_are_those_of_least_squares(
    seed: int, free: tuple[int, ...]
) -> None:
    one = case(seed, free)
    found = Eliminated.of(one.gram.with_instability(TAU), SET, WIDE)
    assert found.score == pytest.approx(one.dense.evidence(SET, WIDE), rel=1e-9)
    mean, cov = one.dense.posterior(SET, WIDE)
    assert_agree(found.estimate, mean)
    assert_agree(found.inverse, cov)


@SEEDS
def test_a_column_that_two_causes_have_may_stand_there_twice(seed: int) -> None:
    one = case(seed)
    twice, wide = np.array([0, 3, 3]), np.array([0.7, 0.4, 1.5])
    found = Eliminated.of(one.gram.with_instability(TAU), twice, wide)
    assert found.score == pytest.approx(one.dense.evidence(twice, wide), rel=1e-9)
    assert_agree(found.estimate, one.dense.posterior(twice, wide)[0])
    # that of a member comes after that of what is always there
    assert found.places_of(np.array([3, 0])).tolist() == [2, 0]


def test_with_nothing_in_it_the_evidence_is_that_of_the_noise() -> None:
    one, none = case(0), np.empty(0, dtype=np.intp)
    found = Eliminated.of(one.gram.with_instability(TAU), none, np.empty(0))
    assert found.score == pytest.approx(one.dense.evidence(none, np.empty(0)), rel=1e-9)


@SEEDS
@FREE
@pytest.mark.parametrize("more", [(1,), (2, 5, 8), (3, 6)], ids=str)
def test_the_gain_of_one_more_group_is_the_rise_of_the_evidence(
    seed: int, free: tuple[int, ...], more: tuple[int, ...]
) -> None:
    """At every size; the group may share a column with the set."""
    one, at = case(seed, free), np.array(more)
    typical = np.linspace(0.02, 0.05, len(at))
    found = Eliminated.of(one.gram.with_instability(TAU), SET, WIDE)
    inner, rhs = found.schur_complement(at, typical)
    before = one.dense.evidence(SET, WIDE)
    both = np.concatenate([SET, at])
    rise = [
        one.dense.evidence(both, np.concatenate([WIDE, v * typical])) - before
        for v in SIZES
    ]
    gain = evidence_gains(inner, rhs, np.diag(inner).max())
    np.testing.assert_allclose(gain, rise, rtol=1e-9, atol=1e-9 * abs(before))


@SEEDS
@FREE
@pytest.mark.parametrize("kind", [0, 5, CLOSURE])
def test_the_gain_of_an_instability_is_the_rise_of_the_evidence(
    seed: int, free: tuple[int, ...], kind: int
) -> None:
    none = np.where(np.arange(7) == kind, 0.0, TAU)
    one, typical = case(seed, free, none), 0.03
    found = Eliminated.of(one.gram.with_instability(none), SET, WIDE)
    inner, rhs = found.schur_complement_of_means(kind)
    inner, rhs = inner * typical**2, rhs * typical
    before = one.dense.evidence(SET, WIDE)
    rise = []
    for v in SIZES:
        tau = np.where(np.arange(7) == kind, v * typical, TAU)
        rise.append(case(seed, free, tau).dense.evidence(SET, WIDE) - before)
    gain = evidence_gains(inner, rhs, np.diag(inner).max())
    np.testing.assert_allclose(gain, rise, rtol=1e-9, atol=1e-9 * abs(before))


def test_gains_of_many_groups_are_those_of_each() -> None:
    one, found = case(1), []
    rows = Eliminated.of(one.gram.with_instability(TAU), SET, WIDE)
    for at in ([1, 2], [5, 6], [8, 1]):
        found.append(rows.schur_complement(np.array(at), np.array([0.3, 0.1])))
    inner, rhs = (np.stack(some) for some in zip(*found, strict=True))
    own = np.diagonal(inner, 0, 1, 2).max(axis=-1)
    each = [evidence_gains(*one, own=top) for one, top in zip(found, own, strict=True)]
    np.testing.assert_allclose(evidence_gains(inner, rhs, own), each, rtol=1e-12)


@SEEDS
def test_what_elimination_leaves_by_rounding_gains_nothing(seed: int) -> None:
    """A column that the set has at any size cannot add anything."""
    one, at = case(seed), np.array([3])
    wide = Eliminated.of(one.gram.with_instability(TAU), SET, np.full(4, 1e9))
    inner, rhs = wide.schur_complement(at, np.array([1.0]))
    own = one.gram.with_instability(TAU).matrix(at, at)[0, 0]
    assert np.array_equal(evidence_gains(inner, rhs, own), np.zeros(len(SIZES)))


@FREE
def test_some_columns_say_the_same_as_they_do_among_all(free: tuple[int, ...]) -> None:
    whole = case(2, free).gram
    part = whole.select_columns(np.array([7, 0, 4, 3, 3]))
    assert part.within.size == 4
    found, same = (
        Eliminated.of(g.with_instability(TAU), SET, WIDE) for g in (part, whole)
    )
    assert found.score == pytest.approx(same.score, rel=1e-12)
    np.testing.assert_allclose(found.estimate, same.estimate, rtol=1e-12)
    np.testing.assert_array_equal(np.flatnonzero(part.index >= 0), SET)


@SEEDS
def test_what_is_known_before_is_as_rows_beside_those_of_the_recording(
    seed: int,
) -> None:
    """Values of sums of columns, with a covariance; also where some are left out."""
    rng = np.random.default_rng(seed + 100)
    plain = case(seed)
    width = plain.dense.design.shape[1]
    known, rows = [], []
    for count in (2, 3):
        design = np.zeros((count, width))
        design[:, rng.permutation(WIDTH)[:4]] = rng.standard_normal((count, 4))
        root = rng.standard_normal((count, count))
        cov = root @ root.T + np.eye(count)
        residual = rng.standard_normal(count)
        known.append(KnownRows.of(design, residual, cov))
        rows.append((residual, design, cov))
    assert {len(one.columns) for one in known} == {4}
    both = KnownRows.concatenated(known)
    one, dense = case(seed, known=both), plain.dense
    more = block_diag(dense.cov, *(cov for *_, cov in rows))
    y = np.concatenate([dense.y, *(residual for residual, *_ in rows)])
    whole = np.vstack([dense.design, *(design for _, design, _ in rows)])
    inner = whole.T @ np.linalg.solve(more, whole)
    rhs = whole.T @ np.linalg.solve(more, y)
    weighted, every = one.gram.with_instability(TAU), np.arange(WIDTH)
    assert_agree(weighted.matrix(every, every), inner[:WIDTH, :WIDTH])
    assert_agree(weighted.rhs(np.arange(len(rhs))), rhs)
    assert weighted.square == pytest.approx(y @ np.linalg.solve(more, y), rel=1e-9)
    assert weighted.log_det == pytest.approx(plain.gram.with_instability(TAU).log_det)


def test_of_what_is_known_before_only_wanted_columns_count() -> None:
    design = np.array([[1.0, 0.0, 2.0], [0.0, 0.0, 3.0]])
    known = KnownRows.of(design, np.array([4.0, 6.0]), np.diag([4.0, 9.0]))
    np.testing.assert_array_equal(known.columns, [0, 2])
    np.testing.assert_allclose(known.design, [[0.5, 1.0], [0.0, 1.0]])
    np.testing.assert_allclose(known.residual, [2.0, 2.0])
    some = SimpleNamespace(
        width=3,
        known=known,
        window_positions=np.arange(1),
        window_error=np.zeros((1, 6)),
        unoriented=np.zeros(1, bool),
    )
    found = gram([], cast(Dictionary, some), np.zeros(3), (), np.array([2, 1]))
    every = np.arange(2)
    np.testing.assert_allclose(
        found.within.part(every, every), [[0.0, 0.0], [0.0, 2.0]]
    )
    np.testing.assert_allclose(found.rhs, [0.0, 4.0])
    assert found.square == pytest.approx(8.0)


@SEEDS
def test_no_size_gains_more_than_each_direction_at_a_size_of_its_own(seed: int) -> None:
    """One direction gains as much at the best size; several do at the same best one."""
    rng = np.random.default_rng(seed)
    strength = np.exp(rng.normal(0.0, 3.0, (50, 3)))
    power = strength * np.exp(rng.normal(1.0, 1.0, (50, 3)))
    strength[:5, 0] = power[:5, 0] = 0.0  # a direction that the rows do not determine
    fine = np.exp(np.linspace(-15.0, 15.0, 4001))
    for s, p in ((strength, power), (strength[:, :1], power[:, :1])):
        bound = largest_gains(s, p)
        best = gains_from_eigenvalues(s, p, fine).max(axis=1)
        assert (best <= bound + 1e-9).all()
    np.testing.assert_allclose(best[5:], bound[5:], rtol=1e-4, atol=1e-5)


@SEEDS
def test_means_that_are_known_far_better_than_rotations_keep_what_they_tell(
    seed: int,
) -> None:
    """Rows across the rotations are as well known as without, along them no better.

    Means of smoothed samples have had errors of 1e-12 m/s^2, and no covariance then.
    """
    one, rng = case(seed, (0,)).gram, np.random.default_rng(seed)
    info = np.where(one.info > 0, 1e24, 0.0)
    turned = np.where(info[..., None] > 0, rng.normal(size=(*info.shape, 2)), 0.0)
    exact = replace(
        one, info=info, shared=0 * info, closure_errors=0 * one.closure_errors,
        free_rotations=turned,
    )  # fmt: skip
    root, log_det = exact.whitening(np.zeros(7))
    expected = 0.0
    for p, own in enumerate(turned):
        there = np.flatnonzero(info[p])
        basis, size, _ = np.linalg.svd(own[there])
        white = root[p][:, there] @ basis
        wide = np.append(size, np.zeros(len(there)))[: len(there)]
        spread = np.hypot(wide, 1e-12)  # of each direction
        known = np.linalg.norm(white, axis=0) * spread
        np.testing.assert_allclose(known, 1.0, rtol=0.02)
        expected += 2 * np.log(spread / 1e-12).sum()
    assert log_det == pytest.approx(expected, rel=1e-9)
