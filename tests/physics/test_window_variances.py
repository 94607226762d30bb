"""What other windows say of the variance in one, against draws from the same law."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import special

from fieldcal.core.samples import Array
from fieldcal.physics import window_variances
from fieldcal.physics.window_variances import variances_of_others


def drawn(nu: float, dof: float, windows: int, seed: int) -> Array:
    """Measured variances (windows, 3) about 4, of true ones that differ by nu."""
    rng = np.random.default_rng(seed)
    true = 4.0 * nu / rng.chisquare(nu, (windows, 3))
    return true * rng.chisquare(dof, true.shape) / dof


@pytest.mark.parametrize("nu", [3.0, 8.0, 30.0])
@pytest.mark.parametrize("dof", [4.0, 12.0])
def test_how_far_windows_differ_is_found(nu: float, dof: float) -> None:
    variance = drawn(nu, dof, 4000, round(nu + dof))
    common, found = variances_of_others(variance, np.full_like(variance, dof))
    assert found.mean() == pytest.approx(nu, rel=0.25)
    assert common.mean() == pytest.approx(4.0, rel=0.1)


def test_windows_alike_tell_as_much_as_all_of_them_have() -> None:
    variance = drawn(1e9, 12.0, 30, 1)
    common, nu = variances_of_others(variance, np.full_like(variance, 12.0))
    assert (nu <= 29 * 12).all() and np.median(nu) > 60
    assert common.mean() == pytest.approx(4.0, rel=0.1)


def test_a_window_does_not_tell_of_itself() -> None:
    variance = drawn(1e9, 12.0, 12, 2)
    dof = np.full_like(variance, 12.0)
    before = variances_of_others(variance, dof)
    variance[5] *= 50.0
    after = variances_of_others(variance, dof)
    for one, other in zip(before, after, strict=True):
        assert one[5] == pytest.approx(other[5])
        # the other windows meet one that is unlike them
    assert (after[1][:5] < before[1][:5]).all() and (after[1][:5] < 4).all()


def test_a_reference_that_leaves_out_one_at_a_time() -> None:
    variance = drawn(6.0, 8.0, 9, 3)
    dof = np.random.default_rng(4).uniform(3, 20, variance.shape)
    common, nu = variances_of_others(variance, dof)
    for w in range(9):
        others = np.arange(9) != w
        half = dof[others] / 2
        log = np.log(variance[others]) - special.digamma(half) + np.log(half)
        beyond = log.var(axis=0, ddof=1) - special.polygamma(1, half).mean(axis=0)
        least = nu[w] < 0.9 * dof[others].sum(axis=0)
        for c in np.flatnonzero((beyond > 0.05) & least):
            psi = special.polygamma(1, nu[w, c] / 2)
            assert psi == pytest.approx(beyond[c], rel=0.3)
            prior = nu[w, c] / 2
            ln = log[:, c].mean() + special.digamma(prior) - np.log(prior)
            assert common[w, c] == pytest.approx(np.exp(ln), rel=0.1)


def test_too_few_windows_and_windows_of_nothing_tell_nothing() -> None:
    variance, dof = drawn(1e9, 12.0, 6, 5), np.full((6, 3), 12.0)
    variance[:3, 1], dof[:3, 2] = 0.0, 0.5
    common, nu = variances_of_others(variance, dof)
    assert (nu[:, 0] > 0).all()
    # each of the three that tell has two others, each of the rest three
    assert (nu[3:, 1:] == 0).all() and (nu[:3, 1:] > 0).all()
    assert (common[3:, 1:] == 1).all()
    assert variances_of_others(variance[:1], dof[:1])[1].tolist() == [[0.0] * 3]


def test_the_series_of_the_gamma_function() -> None:
    x = np.array([1.0, 3.0, 20.0])
    assert window_variances._digamma(x) == pytest.approx(special.digamma(x), abs=8e-3)
    trigamma = window_variances._trigamma(x)
    assert trigamma == pytest.approx(special.polygamma(1, x), abs=0.03)
    y = np.array([0.05, 0.5, 2.0])
    back = special.polygamma(1, window_variances._inverse_trigamma(y))
    assert back == pytest.approx(y, rel=0.15)
