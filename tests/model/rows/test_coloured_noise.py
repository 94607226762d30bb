"""The spectrum of what is left of rows, against spectra that are known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from fieldcal.core.samples import Array
from fieldcal.model.rows import coloured_noise
from fieldcal.model.rows.coloured_noise import Bands
from fieldcal.model.rows.motion import frequencies

LENGTH, COUNT, STEP = 100, 20, 0.05
FREQUENCY = frequencies(LENGTH * COUNT, LENGTH, STEP)
NO_LEVERAGE = [np.zeros(len(FREQUENCY))] * 3


def test_bands_hold_every_coefficient_but_the_mean() -> None:
    bands = Bands.between(FREQUENCY)
    moving = FREQUENCY[FREQUENCY > 0]
    held = np.histogram(moving, np.append(bands.edges[:-1], moving.max() + 1))[0]
    assert held.sum() == len(moving) and held.min() >= 5
    assert (np.diff(bands.place) > 0).all()
    assert np.exp(bands.place[0]) == pytest.approx(moving.min() / 2)


@pytest.mark.statistical
@pytest.mark.parametrize("slope", [0.0, -1.0, -2.0])
def test_a_spectrum_that_is_drawn_comes_back(slope: float) -> None:
    bands, f = Bands.between(FREQUENCY), np.maximum(FREQUENCY, FREQUENCY[LENGTH] / 2)
    off = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        loud = np.array([1.0, 3.0, 0.2])[:, None]
        power = loud * (f**slope + 0.1)
        left = list(np.sqrt(power) * rng.standard_normal(power.shape))
        found = bands.levels(FREQUENCY, left, NO_LEVERAGE)
        for one, true in zip(found, power, strict=True):
            off.append(np.log(bands.power(one, FREQUENCY) / true))
    error = np.array(off)
    assert np.abs(error.mean(axis=0)).max() < 0.5
    quick = FREQUENCY > 1.0
    assert np.abs(error[:, quick]).mean() < 0.15
    assert np.abs(error[:, quick].mean()) < 0.03


def test_what_columns_took_is_no_proof_of_quiet() -> None:
    bands, rng = Bands.between(FREQUENCY), np.random.default_rng(4)
    left = rng.standard_normal((3, len(FREQUENCY)))
    taken = FREQUENCY < 0.1  # a fit that takes nine tenths of these
    left[:, taken] *= np.sqrt(0.1)
    leverage = [np.where(taken, 0.9, 0.0)] * 3
    found = bands.levels(FREQUENCY, list(left), leverage)
    for one in found:
        assert np.abs(bands.power(one, FREQUENCY)[taken].mean() - 1) < 0.5


@pytest.mark.parametrize("known", [False, True])
def test_powers_are_those_for_which_the_sum_is_least(known: bool) -> None:
    """(1) by a general search; the mean of a power is above what is likeliest."""
    rng = np.random.default_rng(7)
    place = np.cumsum(rng.uniform(0.05, 0.9, 9))
    place[4] = place[3] + 0.02  # counts as a tenth
    free, raw = rng.uniform(0.5, 30.0, 8), rng.normal(-3.0, 1.0, 8)
    apart = np.diff(place[:8])
    about = raw.mean() + rng.normal(0.0, 0.5, 8) if known else None

    def total(level: Array) -> float:
        out = (free / 2 * (level + np.exp(raw - level))).sum()
        out += (np.diff(level) ** 2 / (2 * np.maximum(apart, 0.1))).sum()
        if about is not None:
            out += ((level - about) ** 2).sum() / (2 * 0.5**2)
        return float(out)

    best = minimize(total, raw, method="BFGS", options={"gtol": 1e-8}).x
    bend = np.zeros((8, 8))
    for i, one in enumerate(1e-3 * np.eye(8)):
        for j, other in enumerate(1e-3 * np.eye(8)):
            sides = [total(best + a * one + b * other) * a * b
                     for a in (1, -1) for b in (1, -1)]  # fmt: skip
            bend[i, j] = sum(sides) / 4e-6
    expected = best + np.diag(np.linalg.inv(bend)) / 2
    found = coloured_noise._smooth(raw, free, apart, about)
    np.testing.assert_allclose(found, expected, atol=2e-4)


@pytest.mark.parametrize(("slope", "goes_on"), [(-1.2, 1.2), (-3.0, 2.0), (0.7, 0.0)])
def test_the_mean_is_as_loud_as_the_slowest_bands_go_on(
    slope: float, goes_on: float
) -> None:
    """As steeply as a walk at most; what is a factor of five quicker is not asked."""
    bands = Bands.between(FREQUENCY)
    place = bands.place[1:]
    near = place < place[0] + 1.5
    level = 2.0 + slope * (place - place[0])
    level[~near] = 9.0
    found = bands._with_mean_level(level)
    np.testing.assert_array_equal(found[1:], level)
    expected = 2.0 + goes_on * (place[0] - bands.place[0])
    assert 1 < near.sum() < len(near)
    assert found[0] == pytest.approx(expected)
    one = Bands(bands.edges[:1], bands.place[:2])
    np.testing.assert_array_equal(one._with_mean_level(np.array([3.0])), [3.0, 3.0])
