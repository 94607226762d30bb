"""Chances of sums of squares, beside a library's for any degrees of freedom."""

from __future__ import annotations

import doctest
from math import exp

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import gammaincc
from scipy.stats import norm

from fieldcal.core import probability
from fieldcal.core.probability import (
    MAD_TO_SIGMA,
    chi2_tail,
    probability_of_log_odds,
)


@pytest.mark.parametrize("dof", [1, 2, 3, 4, 5, 10, 33, 100, 1001, 20000])
def test_the_tail_is_that_of_the_incomplete_gamma_function(dof: int) -> None:
    for chi2 in (0.0, 1e-6, 0.1, 3.84, 0.5 * dof, dof, 1.2 * dof, 2.0 * dof + 5, 5e3):
        expected = float(gammaincc(dof / 2, chi2 / 2))
        assert chi2_tail(chi2, dof) == pytest.approx(expected, rel=1e-9, abs=1e-290)


def test_what_has_no_end_has_no_chance() -> None:
    assert chi2_tail(np.inf, 3) == 0.0
    assert np.isnan(chi2_tail(np.nan, 4))


def test_a_median_of_deviations_is_that_of_a_normal_spread() -> None:
    assert MAD_TO_SIGMA == pytest.approx(1 / norm.ppf(0.75), rel=1e-4)


@given(st.floats(1e-12, 1 - 1e-12))
def test_odds_of_a_probability_have_that_probability(p: float) -> None:
    log_odds = np.log(p) - np.log1p(-p)
    assert probability_of_log_odds(log_odds) == pytest.approx(p, rel=1e-9)


def test_tiny_probabilities_are_the_odds_and_all_shapes_are_kept() -> None:
    found = probability_of_log_odds([[-700, -40], [0, 800]])
    np.testing.assert_allclose(
        found, [[exp(-700), exp(-40)], [0.5, 1.0]], rtol=1e-12, atol=0
    )
    assert probability_of_log_odds([1, 2]).dtype == float


def test_examples() -> None:
    failed, tried = doctest.testmod(probability)
    assert tried and not failed
