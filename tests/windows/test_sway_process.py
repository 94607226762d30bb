"""Lines in the spectrum of a window, against the waves that it was made of."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import Array
from fieldcal.windows.sway_process import wave_frequencies, without_waves

SPAN_S = 30.0
T: Array = 100.0 + np.arange(0.05, SPAN_S, 0.1)
GRID = np.arange(4, 90) / (2 * SPAN_S)
"""Half a cycle of the window apart, Hz."""

NEAR = 1 / (8 * SPAN_S)
SIZES = np.array([0.2, 0.05, 0.3, 4e-3, 2e-3, 6e-3])


def outputs(lines: list[float], noise: float, strong: float = 1.0) -> Array:
    """Cells of waves about a level that drifts, each as large as the one before."""
    rng = np.random.default_rng(3)
    y: Array = SIZES * (5.0 + 0.1 * (T - T[0])[:, None] / SPAN_S)
    for i, hz in enumerate(lines):
        phase = rng.uniform(0, 2 * np.pi, 6)
        y += strong**i * SIZES * np.sin(2 * np.pi * hz * T[:, None] + phase)
    y += noise * SIZES * rng.standard_normal(y.shape)
    return y


def replaced(y: Array) -> Array:
    """Frequencies that are none of the grid, Hz."""
    found = wave_frequencies(T, y, GRID, NEAR)
    assert (np.diff(found) > 0).all()
    lost = np.setdiff1d(GRID, found)
    own = np.setdiff1d(found, GRID)
    assert all(np.abs(own - one).min() <= NEAR for one in lost)
    return own


@pytest.mark.parametrize(
    "lines", [[0.1473], [1.2391], [0.1473, 0.3331], [0.2119, 0.4642, 0.7093, 0.9914]]
)
def test_lines_have_their_own_frequencies_between_those_of_the_grid(
    lines: list[float],
) -> None:
    """Weaker ones beside stronger ones too; a drift is none."""
    found = replaced(outputs(lines, noise=0.01, strong=0.5))
    for line in lines:
        assert np.abs(found - line).min() < 1e-4
    assert len(found) <= 4


def test_lines_less_than_a_cycle_apart_are_told_apart() -> None:
    lines = [0.2043, 0.2281]
    found = replaced(outputs(lines, noise=0.003))
    for line in lines:
        assert np.abs(found - line).min() < 1e-3


def test_an_output_that_is_only_noise_hides_no_line_of_the_others() -> None:
    y = outputs([0.3331], noise=0.01)
    y[:, 0] = 20.0 * np.random.default_rng(1).standard_normal(len(T))
    assert np.abs(replaced(y) - 0.3331).min() < 1e-4


def test_of_waves_and_a_drift_nothing_is_left() -> None:
    y = outputs([0.1473, 0.3331], noise=0.0)
    left = without_waves(T, y, [0.1473, 0.3331])
    assert np.abs(left / SIZES).max() < 1e-9
    kept = without_waves(T, y, [0.1473]) / SIZES
    assert np.sqrt((kept**2).mean(axis=0)) == pytest.approx([0.5**0.5] * 6, rel=0.1)
