"""The rate of a temperature: as smooth as it is, as sharp as it must be."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import Array, Block
from fieldcal.model.rows.thermometer import Thermometer

T: Array = np.arange(0.0, 360.0, 0.1)


def rate_error(course: Array, seed: int) -> float:
    """Rms of what the rate is off by, K/s, of a thermometer with 20 mK of noise."""
    noise = 0.02 * np.random.default_rng(seed).standard_normal(len(T))
    still = np.zeros((len(T), 3))
    seen = Thermometer.of(Block.of(T, still, still, 25 + course + noise))
    truth = np.interp(seen.t, T, np.gradient(course, T))
    return float(np.sqrt(np.mean((seen.heating - truth) ** 2)))


@pytest.mark.parametrize("seed", range(3))
def test_what_rises_once_has_little_noise_even_at_its_ends(seed: int) -> None:
    assert rate_error(6 * (1 - np.exp(-T / 175)), seed) < 4e-4


@pytest.mark.parametrize("seed", range(3))
def test_what_goes_up_and_down_is_not_flattened(seed: int) -> None:
    course = 3 * np.sin(2 * np.pi * T / 240)
    spread = 3 * 2 * np.pi / 240 / 2**0.5
    assert rate_error(course, seed) < 0.05 * spread
