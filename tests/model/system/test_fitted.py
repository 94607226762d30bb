"""Residuals of a set with what is shared by windows, against dense covariances."""

from __future__ import annotations

import numpy as np
import pytest
from dense_model import shared
from small_sessions import SD, dictionary, ladder, nominal, rows_of

from fieldcal.model.evidence.sets import Sets
from fieldcal.model.priors import SIZES
from fieldcal.model.system.fitted import FittedSet
from fieldcal.model.system.linear_system import gram
from fieldcal.model.system.window_rows import WindowSystem

X = ladder()


def fitted() -> FittedSet:
    """Windows that wander, and gyroscopes that walk, beside a nominal state."""
    d, rng = dictionary(X, common=2e-4), np.random.default_rng(1)
    y = np.hstack([X.f, X.w]) + SD * rng.standard_normal((len(X), 6))
    y += (5e-3 * rng.standard_normal((9, 6)))[X.position]
    rows = rows_of(X, y)
    rows.sd[:] *= rng.uniform(0.5, 2.0, rows.sd.shape)
    values = np.zeros(d.width)
    values[d.bias : d.bias + 3] = 0.01
    linear = WindowSystem(rows, d).linearised(nominal())
    sets = Sets(d, gram(linear, d, values))
    walk = next(c for c in d.causes if c.key == "random_walk:gyr")
    there = sets.evaluate(((walk, walk.variants[0]),))
    return FittedSet(rows, d, linear, values, there)


ONE = fitted()


def test_squares_count_what_the_rows_of_a_window_share() -> None:
    d, rows = ONE.dictionary, ONE.rows
    residual = ONE.residual()
    tau = SIZES[list(ONE.set.sizes.instability)] * d.typical_instability
    assert tau[:3].max() > 1e-3, "windows wander"
    for c in range(6):
        size = np.hypot(d.window_error[X.position, c], tau[c])
        alike = shared(X.position, np.zeros(len(X), dtype=int), size)
        cov = np.diag(rows.sd[:, c] ** 2) + alike
        expected = residual[:, c] @ np.linalg.solve(cov, residual[:, c])
        assert ONE.squares[c] == pytest.approx(expected, rel=1e-9)
    np.testing.assert_allclose(ONE.squares_of(2.0 * residual), 4.0 * ONE.squares)


def test_what_is_random_takes_nothing_from_a_certain_residual() -> None:
    d, whole, certain = ONE.dictionary, ONE.estimate, ONE.deterministic_estimate
    ((_, walk),) = ONE.set.members
    assert whole[walk.columns].any() and not certain[walk.columns].any()
    kept = [c for g in d.always if g.in_state for c in g.columns]
    np.testing.assert_array_equal(certain[kept], whole[kept])
    np.testing.assert_allclose(
        ONE.residual(certain)[:, :3], ONE.residual()[:, :3], atol=1e-15
    )
    assert np.abs(ONE.residual(certain) - ONE.residual())[:, 3:].max() > 1e-6


def test_freedom_is_rows_less_what_was_estimated_of_them() -> None:
    state = ONE.set.state
    spent = len(state.columns) - np.sum(np.diag(state.inverse) / state.prior_sigma**2)
    assert ONE.dof == 6 * len(X) - round(float(spent))
    assert 6 < spent < len(state.columns)
