"""A mean states the root of its variances."""

import numpy as np

from fieldcal.windows import Average


def test_the_standard_errors_are_those_of_the_covariance() -> None:
    root = np.tril(np.random.default_rng(0).normal(size=(6, 6)))
    average = Average(np.zeros(6), root @ root.T, 25.0, 100, 0.0, 1.0)
    np.testing.assert_allclose(average.sigma, np.linalg.norm(root, axis=1))
