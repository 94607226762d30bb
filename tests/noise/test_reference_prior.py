"""The most probable sizes beside dense covariances, and beside the bound."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from benchmarks.noise import ours, spectra
from benchmarks.noise.processes import bound, covariance
from fieldcal.core.samples import Array
from fieldcal.noise.likelihood import Powers, fit_processes
from fieldcal.noise.reference import most_probable_sizes

DT = 0.1


def drawn(seed: int, n: int, columns: int, sizes: dict[str, float]) -> Array:
    """Recordings, (n, columns), from their dense covariance."""
    whole = sum(s**2 * covariance(n, DT, p) for p, s in sizes.items())
    rng = np.random.default_rng(seed)
    found: Array = np.linalg.cholesky(whole) @ rng.standard_normal((n, columns))
    return found


def densely(values: Array, names: str) -> Array:
    """Sizes where likelihood times the root of |J| is highest, sample by sample."""
    n = len(values)
    steps = np.diff(np.eye(n), axis=0)  # the mean drops out of differences
    seen = steps @ values
    parts = [steps @ covariance(n, DT, p) @ steps.T for p in names]

    def worse(x: Array) -> float:
        mine = [np.exp(v) * part for v, part in zip(x, parts, strict=True)]
        whole = sum(mine)
        inverse = np.linalg.inv(whole)
        known = [
            [0.5 * np.sum((inverse @ a) * (inverse @ b).T) for a in mine] for b in mine
        ]
        log_det = np.linalg.slogdet(whole)[1]
        likely = -0.5 * (log_det + seen @ inverse @ seen)
        return float(-likely - 0.5 * np.linalg.slogdet(known)[1])

    found = minimize(worse, np.zeros(len(names)), method="Nelder-Mead",
                     options={"xatol": 1e-5, "fatol": 1e-8})  # fmt: skip
    return np.asarray(np.exp(found.x / 2))


def test_they_are_those_of_dense_covariances() -> None:
    """Walk and noise are independent in the coefficients, exactly."""
    sizes = {"N": 1.0, "K": 1.0}
    values = drawn(1, 60, 4, sizes)
    found, _ = ours(values, sizes)
    exact = np.array([densely(column, "NK") for column in values.T])
    # bins of an eighth of an octave are the only difference
    assert found == pytest.approx(exact, rel=0.02)


def test_white_noise_alone_is_what_is_most_likely() -> None:
    """Its information is the number of coefficients, whatever its size."""
    values = drawn(2, 300, 3, {"N": 2.0})
    found, sigma = ours(values, {"N": 2.0})
    assert found[:, 0] == pytest.approx(values.std(axis=0, ddof=1) * DT**0.5, rel=1e-4)
    assert sigma[:, 0] == pytest.approx(1 / np.sqrt(2 * 299), rel=1e-6)


@pytest.mark.statistical
def test_a_walk_known_to_a_third_has_no_bias_and_reaches_the_bound() -> None:
    """The most likely one is 7 % too small on average, and misses it by a tenth."""
    sizes = {"N": 1.0, "K": 0.3}
    found, _ = ours(drawn(3, 600, 200, sizes), sizes)
    errors = found[:, 1] / 0.3 - 1
    best = bound(600, DT, sizes)[1]
    # the mean is known to 0.025, the ratio to 5 %
    assert abs(errors.mean()) < 0.05
    assert np.sqrt(np.mean(errors**2)) < 1.1 * best
    assert (found[:, 1] > 0.03).all()


def test_a_correlation_time_stays_where_it_was() -> None:
    values = drawn(4, 600, 1, {"N": 1.0, "K": 0.5})
    spectrum = spectra(values)
    power, count = spectrum.channel_powers(
        0, spectrum.last.values[:, 0], np.ones(len(spectrum.last.bin))
    )
    powers = Powers(power, count, np.zeros(len(power), dtype=bool))
    start = np.array([0.0, 0.0, np.log(10.0)])
    likely = fit_processes(spectrum, powers, ("N", "G"), start)
    assert likely is not None
    found = most_probable_sizes(spectrum, powers, likely)
    assert found.x[2] == likely.x[2] and found.x[1] != likely.x[1]
    assert found.log_likelihood == likely.log_likelihood
