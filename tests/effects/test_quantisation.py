"""The step of rounded outputs, and how well it is known."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import Block
from fieldcal.diagnosis.signal.chain import samples_to_check
from fieldcal.effects.quantisation import Quantisation, step_deviation
from fieldcal.session.description_file import parse_description

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


@pytest.mark.parametrize(
    ("noise", "matters"), [(0.3 * STEP, True), (0.8 * STEP, True), (2.5 * STEP, False)]
)
def test_a_hand_that_trembles_is_no_noise_beside_the_step(
    noise: float, matters: bool
) -> None:
    """It moves the outputs by several steps, slowly: each is rounded all the same."""
    rng = np.random.default_rng(5)
    t = np.arange(6000) / 100
    tremor = 3 * STEP * np.sin(2 * np.pi * 0.7 * t + rng.uniform(0, 6, (3, 1))).T
    gyr = tremor + rng.normal(0, noise, (6000, 3))
    acc = rng.normal(0, 0.02, (6000, 3)) + [0.0, 0.0, 9.8]
    block = Block.of(t, acc, np.round(gyr / STEP) * STEP)
    about = parse_description({"device": {"name": "d", "grade": "consumer"}})
    samples = samples_to_check(block, np.isfinite(block.six), about)
    assert samples.noise[3:].min() > 1.2 * STEP
    found = [f.values for f in Quantisation().find(samples)]
    assert bool(found) is matters
    assert all(f == pytest.approx({"gyr": STEP}) for f in found)
