"""The spectrum of what is left of rows, against spectra that are known."""

from __future__ import annotations

import numpy as np
import pytest

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
