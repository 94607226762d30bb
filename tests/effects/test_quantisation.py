"""The step of rounded outputs, and how well it is known."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.effects.quantisation import step_deviation

STEP = 16 / 32768
"""Of a device with 16 bits over 16 g each way, g."""


@pytest.mark.parametrize("digits", [4, 5, 9])
def test_a_step_is_as_well_known_as_the_digits_of_the_log(digits: int) -> None:
    """Its values are rounded once more, and lie beside the grid of the device."""
    off = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        counts = rng.integers(-2000, 2000, 3) + rng.integers(0, 40, (400, 3))
        log = np.round(STEP * counts.astype(float), digits)
        shown = np.unique(log[:, 0])
        step = float(np.ptp(shown)) / round(float(np.ptp(shown)) / STEP)
        off.append((step - STEP) / step_deviation(log, 0, step))
    assert np.sqrt(np.mean(np.square(off))) < 3


def test_axes_with_two_values_each_that_disagree_show_how_rough_a_step_is() -> None:
    low, change = np.array([0.0020, -0.0020, 0.9995]), np.array([4e-4, 5e-4, 5e-4])
    log = low + change * (np.arange(40.0)[:, None] % 2)
    assert abs(4e-4 - STEP) < 2 * step_deviation(log, 0, 4e-4)
