"""A set beside many instabilities, against rows whose covariance is written out."""

from __future__ import annotations

import numpy as np
import pytest
from dense_model import Dense
from gram_cases import TAU, WIDTH, case

from fieldcal.core.samples import Array
from fieldcal.model import tolerances
from fieldcal.model.evidence.levels import scan_instabilities

SET = np.array([0, 3, 4, 7])
WIDE = np.array([0.7, 2.0, 0.05, 1.0])
FURTHER = np.array([[1, 2], [5, 6], [WIDTH, WIDTH + 1]])
GYRO = np.array([[1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0], [1.0] * 3 + [7.0] * 3 + [1.0]])
ACC = np.array([[0.2, 3.0, 0.0, 1.0, 1.0, 1.0, 1.0], [5.0] * 3 + [1.0] * 4])
TURNS = np.array([[1.0] * 6 + [0.0], [1.0] * 6 + [9.0]])


def left(dense: Dense, block: Array) -> tuple[Array, Array, Array]:
    """What the rows say of a block of columns beside the set, and by themselves."""
    some = dense.design[:, block]
    total = dense.total(SET, WIDE)
    inner = some.T @ np.linalg.solve(total, some)
    alone = np.diag(some.T @ np.linalg.solve(dense.cov, some))
    return inner, some.T @ np.linalg.solve(total, dense.y), alone


@pytest.mark.parametrize(
    "at_once", [1, tolerances.MAX_NUMBERS], ids=["single", "together"]
)
@pytest.mark.parametrize("free", [(), (1, 3)], ids=["set", "loose"])
@pytest.mark.parametrize("times", [ACC, GYRO, TURNS], ids=["acc", "gyro", "turns"])
def test_levels_are_those_of_the_rows_written_out(
    times: Array,
    free: tuple[int, ...],
    at_once: int,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(tolerances, "MAX_NUMBERS", at_once)
    taus = TAU * times
    found = scan_instabilities(case(2, free).gram, SET, WIDE, taus, FURTHER)
    for n, tau in enumerate(taus):
        dense = case(2, free, tau).dense
        assert found.score[n] == pytest.approx(dense.evidence(SET, WIDE), rel=1e-9)
        for w, block in enumerate(FURTHER):
            inner, rhs, alone = left(dense, block)
            np.testing.assert_allclose(found.inner[n, w], inner, rtol=1e-8, atol=1e-9)
            np.testing.assert_allclose(found.rhs[n, w], rhs, rtol=1e-8, atol=1e-9)
            np.testing.assert_allclose(found.diagonal[n, w], alone, rtol=1e-8)


def test_a_set_that_may_be_given_nothing_has_its_score_all_the_same() -> None:
    none = np.empty((0, 1), dtype=np.intp)
    found = scan_instabilities(case(0).gram, SET, WIDE, TAU * ACC, none)
    expected = [case(0, (), tau).dense.evidence(SET, WIDE) for tau in TAU * ACC]
    np.testing.assert_allclose(found.score, expected, rtol=1e-9)
    assert found.inner.shape == (2, 0, 1, 1)
