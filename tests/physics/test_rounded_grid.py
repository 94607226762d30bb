"""Steps of a device below the digits of a log that rounded its values once more."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import Array, Block
from fieldcal.physics.grid_stretches import grids_by_stretch
from fieldcal.physics.rounded_grid import grid_below_digits

STEP = 16 / 32768
"""Of 16 bits over 16 g each way, g."""


def rests(seed: int, noise: float) -> Array:
    """Counts (n, 3) of a device at rest on eight sides, and on its way between them."""
    rng = np.random.default_rng(seed)
    up = rng.normal(size=(9, 3))
    up *= 2048 / np.linalg.norm(up, axis=1, keepdims=True)
    stations = np.repeat(np.arange(9.0), 60) + np.tile(
        np.r_[np.zeros(45), np.linspace(0, 1, 15)], 9
    )
    at = [np.interp(stations, np.arange(9), axis) for axis in up.T]
    counts: Array = np.round(np.column_stack(at) + rng.normal(0, noise, (540, 3)))
    return counts


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("noise", [0.3, 1.0, 4.0])
def test_the_digits_of_a_log_are_no_grids_of_its_stretches(
    seed: int, noise: float
) -> None:
    """Here a few neighbouring values lie 5e-4 apart, and there 4e-4."""
    counts = rests(seed, noise)
    log = np.round(STEP * counts, 4)
    grids = grids_by_stretch(Block.of(np.arange(len(log)) / 10, log))
    assert not grids.changed.any()
    np.testing.assert_allclose(grids.steps[0, :3], STEP, rtol=1e-4)


@pytest.mark.parametrize("digits", [1e-4, 1e-5])
def test_what_lies_on_no_grid_of_a_device_has_none(digits: float) -> None:
    rng = np.random.default_rng(3)
    for many in (5, 30, 300):
        shown = np.unique(np.round(rng.normal(0, 0.7, many) / digits)) * digits
        assert not grid_below_digits(shown, digits)
    assert not grid_below_digits(np.arange(100) * digits, digits)


@pytest.mark.parametrize("digits", [1e-4, 1e-5, 1e-6])
@pytest.mark.parametrize("many", [300, 20000])
def test_a_step_is_found_among_few_values_and_many(digits: float, many: int) -> None:
    counts = np.round(np.random.default_rng(many).normal(0, 1500, many))
    shown = np.unique(np.round(STEP * counts / digits) * digits)
    assert abs(grid_below_digits(shown, digits) / STEP - 1) < 1e-5


@pytest.mark.parametrize(
    "many", [1.7, 2.6, 3.958, 6.3, 11.4, 13.7, 14.1, 15.3, 17.3, 23.4, 38.1]
)
@pytest.mark.parametrize("noise", [0.3, 1.5, 3.0])
def test_the_step_of_a_device_is_found_however_few_digits_are_finer(
    many: float, noise: float
) -> None:
    """From two to forty digits in a step, never a multiple of it or a part."""
    rng = np.random.default_rng(100)
    step = 1e-3 * many
    up = rng.uniform(-10.0, 10.0, (7, 3))
    share = np.concatenate([np.zeros(300), (1 - np.cos(np.linspace(0, np.pi, 80))) / 2])
    held = np.concatenate(
        [a + share[:, None] * (b - a) for a, b in zip(up, up[1:], strict=False)]
    )
    counts = np.round((held + rng.normal(0, noise * step, held.shape)) / step)
    log = np.round(step * counts, 3)
    grids = grids_by_stretch(Block.of(np.arange(len(log)) / 100, log))
    assert not grids.changed.any()
    np.testing.assert_allclose(grids.steps[0, :3], step, rtol=2e-3)


def test_of_steps_that_explain_all_values_the_widest_is_taken() -> None:
    """3.958 digits wide, and half of 4.043 as well, as both are odd as often."""
    counts = np.random.default_rng(1).integers(-2400, 2400, 700)
    shown = np.unique(np.round(3.958e-3 * counts, 3))
    assert abs(grid_below_digits(shown, 1e-3) / 3.958e-3 - 1) < 1e-4
