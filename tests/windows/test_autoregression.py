"""Share of the previous output that is kept, against simulations and slow sums."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from fieldcal.core.samples import Array
from fieldcal.windows.autoregression import (
    OWN_SAMPLES,
    RestSums,
    Share,
    autocovariance,
    mean_variance,
    share_kept,
)


def rests(seed: int, kept: float, many: int = 6, samples: int = 600) -> list[Array]:
    """Outputs of white noise, each sample of which keeps a share of the last one."""
    rng = np.random.default_rng(seed)
    out = []
    for _ in range(many):
        x = rng.normal(0, [1.0, 3.0, 0.2], (samples + 2000, 3))
        out.append(lfilter([1 - kept], [1.0, -kept], x, axis=0)[2000:])
    return out


def test_the_mean_of_a_short_rest_makes_k_no_smaller() -> None:
    """Of 600 samples the mean takes 4 / 600 of k, which is a sixth of 1 - k."""
    kept, pulls = 0.96, []
    for seed in range(40):
        one = share_kept([RestSums.of(y) for y in rests(seed, kept)])
        assert one is not None
        pulls.append((one.kept - kept) / one.sigma)
    assert abs(np.mean(pulls)) < 0.5
    assert 0.75 < np.std(pulls) < 1.3


def test_a_rest_that_differs_is_left_out() -> None:
    kept, near = 0.96, Share(0.96, 1e-3)
    for seed in range(5):
        some = rests(seed, kept)
        ramp = np.linspace(0, 40, 600)[:, None] + some[0]  # of which k is nearly one
        held = [RestSums.of(y) for y in [*some[1:], ramp]]
        whole, left = share_kept(held), share_kept(held, near)
        assert whole is None or whole.samples > 60
        assert left is not None and abs(left.kept - kept) < 4 * left.sigma < 0.03


def test_white_noise_has_none() -> None:
    for seed in range(20):
        one = share_kept([RestSums.of(y) for y in rests(seed, 0.0)])
        assert one is None or one.samples < OWN_SAMPLES or one.sigma > 0.05


def test_products_are_those_of_slow_sums() -> None:
    rng = np.random.default_rng(5)
    parts = [rng.normal(size=(n, 2)) for n in (40, 25)]
    got = autocovariance(parts, 30)
    for lag in range(31):
        slow = [
            sum(p[i] * p[i + lag] for i in range(max(len(p) - lag, 0))) for p in parts
        ]
        assert got[lag] == pytest.approx((slow[0] + slow[1]) / 65)
    assert mean_variance(parts, 0) == pytest.approx(got[0])


def test_the_variance_of_means_is_that_of_many_means() -> None:
    rng = np.random.default_rng(6)
    e = lfilter([0.5, 0.3, 0.2], [1.0], rng.normal(size=(60_000, 1)), axis=0)
    means = e.reshape(-1, 100, 1).mean(axis=1)
    assert mean_variance([e]) == pytest.approx(100 * means.var(), rel=0.15)


def test_a_time_constant_is_known_as_well_as_its_share() -> None:
    one, more = Share(0.98, 1e-6), Share(0.98 + 1e-6, 0.0)
    assert one.samples_sigma == pytest.approx(more.samples - one.samples, rel=1e-3)
