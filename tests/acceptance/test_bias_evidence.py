"""Likelihood ratios of ways to remove a bias, against what they have to be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fieldcal.acceptance.bias_cases import AVERAGES, BiasSpread, kept_cases
from fieldcal.acceptance.bias_evidence import (
    FOLLOWED_SHARE,
    RECORDED_MEAN_SHARE,
    UNBIASED,
    UNSEEN_MEAN_SHARE,
    removals_by_likelihood,
    removals_of_recorded_means,
)
from fieldcal.acceptance.rest_steps import RestStep
from fieldcal.acceptance.subtracted_means import WAYS
from fieldcal.acceptance.tracked_bias import log_likelihoods

KEEPS, DENSITY = BiasSpread(1e-3), np.array([1e-9])
NO_RATE = np.full(1, np.nan)


def stops(bias: float, scatter: float = 1e-5) -> list[RestStep]:
    """Three stops of 20 s, an axis and `WAYS` with the same rates."""
    rng = np.random.default_rng(7)
    out = []
    for k in range(3):
        if k:
            out.append(RestStep(1.0, 0.0, NO_RATE, turned=True))
        for part in range(4):
            rate = bias + scatter * rng.standard_normal(1)
            every = np.tile(rate, (len(WAYS), 1))
            out.append(RestStep(5.0, 1.0 + 5.0 * part, every))
    return out


def moved(steps: list[RestStep], size: float) -> list[RestStep]:
    """The same with another rate in each stop, as far as `size`."""
    out, at = [], 0.0
    for step in steps:
        at = -at - size if step.turned else at
        out.append(replace(step, rates=step.rates + at))
    return out


def test_rates_that_are_as_likely_before_leave_the_share() -> None:
    rates = stops(2e-4)
    found = list(removals_of_recorded_means(rates, rates, DENSITY, KEEPS))
    assert len(found) == len(WAYS)
    expected = np.log(RECORDED_MEAN_SHARE / len(WAYS)) - np.log1p(-UNBIASED)
    assert [way.log_odds for way in found] == pytest.approx([expected] * len(WAYS))
    assert found[0].how == "as a mean over about 0.5 s after each turn"


def test_rates_that_agree_only_before_are_those_of_a_removal() -> None:
    before = stops(2e-4)
    outputs = moved(before, 8e-5)
    cases = kept_cases(KEEPS, DENSITY, 0.0)
    logs = [
        np.logaddexp.reduce(
            log_likelihoods(s, DENSITY, 1e-6, cases)[0] + np.log(cases["share"]), axis=1
        )
        for s in (before, outputs)
    ]
    ratio = float((logs[0] - logs[1])[0])
    assert ratio > 2.0
    (way, *_) = removals_of_recorded_means(outputs, before, DENSITY, KEEPS)
    share = np.log(RECORDED_MEAN_SHARE / len(WAYS)) - np.log1p(-UNBIASED)
    assert way.log_odds == pytest.approx(ratio + share)


def test_what_nothing_explains_tells_little() -> None:
    """Scatter of a hundred times the noise divides the log of the ratio."""
    quiet, loud = ((stops(2e-4, s), s) for s in (1e-5, 1e-3))
    sizes = []
    for before, scatter in (quiet, loud):
        outputs = moved(before, 20 * scatter)
        (way, *_) = removals_of_recorded_means(outputs, before, DENSITY, KEEPS)
        sizes.append(way.log_odds - np.log(RECORDED_MEAN_SHARE / len(WAYS)))
    assert 0 < sizes[1] < sizes[0]


def test_a_device_follows_its_bias_as_often_as_it_averages_it() -> None:
    alike = [replace(s, rates=s.rates[0] if s.rates.ndim > 1 else s.rates)
             for s in stops(2e-4)]  # fmt: skip
    found = list(removals_by_likelihood(alike, DENSITY, KEEPS))
    assert len(found) == 1 + len(AVERAGES)
    assert (
        pytest.approx(1.0) == FOLLOWED_SHARE + UNSEEN_MEAN_SHARE + RECORDED_MEAN_SHARE
    )
    assert "time constant" in found[0].how and "mean over" in found[-1].how
    assert all(way.log_odds < 0 for way in found)
