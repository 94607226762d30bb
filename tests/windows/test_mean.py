"""A mean states the root of its variances."""

import numpy as np
import pytest

from fieldcal.windows import Average


def test_the_standard_errors_are_those_of_the_covariance() -> None:
    root = np.tril(np.random.default_rng(0).normal(size=(6, 6)))
    average = Average(np.zeros(6), root @ root.T, 25.0, 100, 0.0, 1.0)
    np.testing.assert_allclose(average.sigma, np.linalg.norm(root, axis=1))


def test_an_error_is_no_less_than_that_of_noise_that_is_always_there() -> None:
    sigma = np.array([1e-3, 1e-9, 0.0, np.nan, 1e-5, 1e-7])
    covariance = np.diag(sigma**2)
    covariance[0, 1] = covariance[1, 0] = 0.5e-12
    found = Average(np.zeros(6), covariance, 20.0, 100, 0.0, 1.0)
    wider = found.no_better_than(np.full(6, 1e-6))
    assert wider.sigma[[0, 1, 2, 4, 5]] == pytest.approx([1e-3, 1e-7, 0, 1e-5, 1e-7])
    assert np.isnan(wider.sigma[3])
    assert wider.covariance[0, 1] == pytest.approx(0.5e-10), "as correlated as before"
