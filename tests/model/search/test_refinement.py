"""Shape parameters between the points of their grids, and how well they are known."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_sessions import LADDER, SD, dictionary, ladder, nominal, rows_of

from fieldcal.core.samples import Array
from fieldcal.effects import catalogue
from fieldcal.model.causes.cause import Group
from fieldcal.model.posterior.time_constants import sets_at_other_time_constants
from fieldcal.model.search.gauss_newton import GaussNewton
from fieldcal.model.search.inference import Inference
from fieldcal.model.search.refinement import Refinement, around, parabola_top
from fieldcal.model.state import State, Term
from fieldcal.model.system.window_rows import WindowSystem

X = ladder(6)
EFFECT = catalogue()["thermal_transient"]
SPAN = float(np.ptp(X.t))
SIZES = np.array([0.03, -0.02, 0.01, 0.0, 0.0, 0.0])


@given(
    st.integers(1, 3),
    st.integers(0, 2**32 - 1),
)
def test_a_parabola_is_found_from_its_scores(m: int, seed: int) -> None:
    """Top and curvature, with every correlation, of one that peaks within a step."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(m, m)) + 2 * np.eye(m)
    curvature = root @ root.T
    top = rng.uniform(-0.9, 0.9, m)
    points = np.array([np.zeros(m), *around(m)]) - top
    scores = 7.0 - 0.5 * np.einsum("ni,ij,nj->n", points, curvature, points)
    found, bend = parabola_top(scores.tolist())
    np.testing.assert_allclose(found, top, atol=1e-7)
    np.testing.assert_allclose(bend, curvature, rtol=1e-6, atol=1e-7)


def test_beyond_a_step_is_a_step_and_a_saddle_has_no_correlation() -> None:
    top, _ = parabola_top([0.0, -5.0, 4.0])
    assert top.tolist() == [1.0]
    scores = [0.0, -1.0, -1.0, -1.0, -1.0, -9.0]  # a cross term beyond both bends
    top, bend = parabola_top(scores)
    assert top.tolist() == [0.0, 0.0] and bend.tolist() == [[2.0, 0.0], [0.0, 2.0]]


def heated(seed: int, at: float, tau: float, rows: Array) -> Refinement:
    """A device whose biases change from an instant on; fitted without that."""
    term = Term(EFFECT, SIZES, {"at_s": at, "tau_s": tau})
    state = State(np.zeros(6), np.ones(6), np.zeros((len(LADDER), 2)), np.zeros(3),
                  (term,))  # fmt: skip
    d = dictionary(X)
    y = state.output(state.experienced(X), d.since)
    y += SD * np.random.default_rng(seed).standard_normal(y.shape)
    rows[:] = y[:, :3]
    fit = GaussNewton(WindowSystem(rows_of(X, y), d), nominal())
    cause = next(c for c in d.causes if c.key == "thermal_transient:acc")
    far = [abs(g.shape["at_s"] - at) + abs(g.shape["tau_s"] - tau)
           for g in cause.variants if len(g.params) == 3]  # fmt: skip
    whole = [g for g in cause.variants if len(g.params) == 3]
    members = ((cause, whole[int(np.argmin(far))]),)
    current, values, found = fit.settle(nominal(), np.zeros(d.width), members)
    return Refinement(fit, current, values, found.sizes)


def refined(seed: int, at: float, tau: float, rows: Array) -> Group:
    refinement = heated(seed, at, tau, rows)
    cause = next(c for c in refinement.fit.dictionary.causes
                 if c.key == "thermal_transient:acc")  # fmt: skip
    whole = [g for g in cause.variants if len(g.params) == 3]
    start = whole[np.argmin([abs(g.shape["at_s"] - at) for g in whole])]
    ((_, group),) = refinement.refine_shapes(((cause, start),))
    return group


def squares(rows: Array, at: float, tau: float) -> float:
    """What is left of three axes with bias, scale factor and the change, over SD^2."""
    course = 1 - np.exp(-np.maximum(X.t - at, 0.0) / tau)
    left = 0.0
    for i in range(3):
        design = np.column_stack([np.ones(len(X)), X.f[:, i], course])
        value = np.linalg.lstsq(design, rows[:, i], rcond=None)[0]
        left += float(((rows[:, i] - design @ value) ** 2).sum()) / SD[i] ** 2
    return left


def test_an_onset_and_a_time_constant_are_those_of_least_squares() -> None:
    """And their covariance is the inverse curvature of half the squares there.

    The model's windows may be unstable, those of least squares are not, so the two
    differ by a part of their uncertainty.
    """
    rng, rows = np.random.default_rng(4), np.zeros((len(X), 3))
    more, rises = [], []
    for seed in range(100, 106):
        at, tau = rng.uniform(0.25, 0.6) * SPAN, rng.uniform(0.1, 0.3) * SPAN
        group = refined(seed, at, tau, rows)
        assert group.shape_covariance is not None
        found = np.array([group.shape["at_s"], np.log(group.shape["tau_s"])])

        def half(u: Array) -> float:
            return 0.5 * squares(rows, u[0], float(np.exp(u[1])))

        scale = np.sqrt(np.diag(group.shape_covariance))
        near = [
            found + scale * u for u in np.random.default_rng(1).normal(size=(200, 2))
        ]
        least = min(near, key=half)
        more.append(half(found) - half(least))
        for one in np.linalg.cholesky(group.shape_covariance).T:
            rises.append((half(found + one) + half(found - one)) / 2 - half(found))
    assert np.mean(more) < 0.5
    # at one standard uncertainty half a unit more
    assert np.median(rises) == pytest.approx(0.5, rel=0.3)


@pytest.mark.parametrize("draws", [8, pytest.param(60, marks=pytest.mark.thorough)])
def test_an_onset_is_as_uncertain_as_it_says(draws: int) -> None:
    """Over many draws; of both shape parameters with their correlation."""
    rng = np.random.default_rng(8)
    total = 0.0
    rows = np.zeros((len(X), 3))
    for seed in range(draws):
        at, tau = rng.uniform(0.25, 0.6) * SPAN, rng.uniform(0.1, 0.3) * SPAN
        group = refined(seed, at, tau, rows)
        assert group.shape_covariance is not None
        log_off = np.log(group.shape["tau_s"] / tau)
        off = np.array([group.shape["at_s"] - at, log_off])
        total += float(off @ np.linalg.solve(group.shape_covariance, off))
    # chi^2 with two degrees of freedom each
    assert abs(total - 2 * draws) < 4 * np.sqrt(4 * draws)


def test_sets_at_other_shapes_have_their_covariance() -> None:
    """The points of equal weight scatter as the shape does, correlation included."""
    term = Term(EFFECT, SIZES, {"at_s": 0.4 * SPAN, "tau_s": 0.2 * SPAN})
    state = State(np.zeros(6), np.ones(6), np.zeros((len(LADDER), 2)), np.zeros(3),
                  (term,))  # fmt: skip
    d = dictionary(X)
    y = state.output(state.experienced(X), d.since)
    y += SD * np.random.default_rng(5).standard_normal(y.shape)
    found = Inference(GaussNewton(WindowSystem(rows_of(X, y), d), nominal())).run()
    ((cause, group),) = found.best.members
    assert cause.name == "thermal_transient" and group.shape_covariance is not None
    moved = [s.members[0][1].shape for s in sets_at_other_time_constants(found)]
    off = np.array([
        [s["at_s"] - group.shape["at_s"], np.log(s["tau_s"] / group.shape["tau_s"])]
        for s in moved
    ])  # fmt: skip
    assert len(off) == 4
    np.testing.assert_allclose(off.T @ off / 4, group.shape_covariance, rtol=1e-6)


def test_onsets_lie_between_positions() -> None:
    grid = sorted({g.shape["at_s"] for c in dictionary(X).causes for g in c.variants
                   if c.name == "thermal_transient"})  # fmt: skip
    held = [X.t[X.position == p] for p in range(len(LADDER))]
    gaps = [(a.max(), b.min()) for a, b in pairwise(held)]
    assert len(grid) == len(gaps)
    assert all(low < at < high for at, (low, high) in zip(grid, gaps, strict=True))
