"""What a base turns to and fro by at the ends of a turn, from its gyroscopes alone."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import Array, Block
from fieldcal.model import detections
from fieldcal.model.rows.row_source import RowSource
from fieldcal.model.rows.thermometer import Thermometer
from fieldcal.model.turns.tremor import sway_at_ends, sway_variance
from fieldcal.session.description_file import parse_description

STEP, SECONDS = 0.01, 10.0


def rates(size: float, hz: float, noise: float, seed: int) -> Array:
    """Of a base that sways about one axis by a sine of some size, rad, (n, 3)."""
    t = np.arange(0, SECONDS, STEP)
    pulse = 2 * np.pi * hz
    along = np.array([0.0, 0.6, 0.8])
    wave = size * pulse * np.cos(pulse * t + seed)[:, None] * along
    white = np.random.default_rng(seed).normal(0, noise, (len(t), 3))
    out: Array = 0.02 + wave + white  # a constant is the bias, and no swaying
    return out


@pytest.mark.parametrize("hz", [0.7, 1.6, 4.0])
def test_a_sine_is_half_its_square_about_the_axis_with_most_of_it(hz: float) -> None:
    found = sway_variance(rates(2e-3, hz, 0.0, 1), STEP)
    assert found == pytest.approx(0.64 * 2e-3**2 / 2, rel=0.06)


def test_noise_is_no_swaying() -> None:
    """Its walk is a third as large as the sine here: 1.5e-2^2 x 0.01 x 10 / 15."""
    size = 3.5e-3
    found = [sway_variance(rates(size, 1.6, 1.5e-2, seed), STEP) for seed in range(300)]
    assert np.mean(found) == pytest.approx(0.64 * size**2 / 2, rel=0.1)


def test_of_a_few_samples_nothing_is_known() -> None:
    assert (
        sway_variance(rates(2e-3, 1.6, 0.0, 1)[: detections.MIN_SAMPLES - 1], STEP)
        == 0.0
    )


def test_ends_of_a_turn_sway_by_ten_seconds_on_either_side_of_it() -> None:
    """Their variances add up; a side without all its samples tells nothing."""
    n = round(SECONDS / STEP)
    parts = [rates(size, 1.6, 0.0, 1) for size in (9e-3, 2e-3, 7e-3, 3e-3, 8e-3)]
    unit = np.array([2.0, -4.0, 0.5])
    gyr = np.vstack(parts) * unit
    block = Block.of(STEP * np.arange(5 * n), np.zeros_like(gyr), gyr)
    about = parse_description({"format": 1, "nominal": {"gyr_scale": unit.tolist()}})
    usable = np.ones((5 * n, 6), dtype=bool)
    source = RowSource(block, about, usable, np.zeros(1), Thermometer.of(block))
    windows = np.array([[0, 2 * n], [3 * n, 5 * n]])
    own = [sway_variance(one, STEP) for one in parts]
    assert sway_at_ends(source, windows) == pytest.approx(own[1] + own[3])
    usable[2 * n - 5, 4] = False
    assert sway_at_ends(source, windows) == pytest.approx(own[3])
    usable[3 * n + 5, :3] = False  # of the accelerometers alone
    assert sway_at_ends(source, windows) == pytest.approx(own[3])
    short = np.array([[2 * n - n // 2, 2 * n - 10], [3 * n, 3 * n + n // 2]])
    half = [sway_variance(parts[1][n // 2 : -10], STEP),
            sway_variance(parts[3][: n // 2], STEP)]  # fmt: skip
    usable[:] = True
    assert sway_at_ends(source, short) == pytest.approx(sum(half))
