"""Variances of cosine coefficients beside those of dense covariances."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.fft import dct

from benchmarks.noise.processes import covariance
from fieldcal.core.samples import Array
from fieldcal.noise import cosine

N, DT = 48, 0.1


def dense(process: str, m: int, time: float = 1.0) -> Array:
    """Variance of the coefficients of N means over m samples each."""
    means = np.kron(np.eye(N), np.full((1, m), 1 / m))
    to = dct(np.eye(N), norm="ortho", axis=0)[1:] @ means
    return np.asarray(np.sum(to @ covariance(N * m, DT, process, time) * to, axis=1))


@pytest.mark.parametrize("m", [1, 4, 8])
def test_variances_are_those_of_the_covariance(m: int) -> None:
    for process, of in (
        ("N", cosine.white),
        ("Q", cosine.quantisation),
        ("K", cosine.walk),
    ):
        assert of(N, m, DT) == pytest.approx(dense(process, m), rel=1e-9)
    for time in (0.01, 0.3, 5.0, 1e3):
        found = cosine.markov(N, m, DT, time)
        assert found == pytest.approx(dense("G", m, time), rel=1e-7)


@pytest.mark.parametrize("m", [1, 8, 4096, 32768])
@pytest.mark.parametrize("spans", [1e-4, 9.9e-4, 1.01e-3, 0.1, 160.0])
def test_what_two_means_differ_by_is_exact_however_slow_a_process(
    m: int, spans: float
) -> None:
    """Of two means over m samples the coefficient is (y_0 - y_1) / sqrt 2.

    Its weights add to nothing, so 1 - exp(-a h) may stand in the place of exp(-a h).
    """
    h = np.arange(1, 2 * m)
    weight = np.where(h <= m, 2 * m - 3 * h, h - 2 * m) / m**2 / 2
    exact = 2 * np.sum(weight * np.expm1(-spans / m * h))
    found = cosine.markov(2, m, DT, m * DT / spans)
    assert found == pytest.approx(exact, rel=1e-6)


def test_white_noise_and_walk_are_independent_in_cosines() -> None:
    to = dct(np.eye(N), norm="ortho", axis=0)[1:]
    for process in ("N", "K"):
        whole = to @ covariance(N, DT, process) @ to.T
        size = np.sqrt(np.diag(whole))
        rest = whole / np.outer(size, size) - np.eye(N - 1)
        assert np.abs(rest).max() < 1e-10
