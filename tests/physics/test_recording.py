"""The grid that values lie on: counts written in decimals, and few values on none."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.physics.recording import lsb_of


@pytest.mark.parametrize("count", [1.33e-3, 2.39e-3, 5.98e-3, 7.5e-3, 9.3e-3])
def test_counts_that_are_written_in_decimals_lie_on_those(count: float) -> None:
    """Beyond two thousandths no two values are neighbours on them."""
    rng = np.random.default_rng(3)
    values = np.round(np.round(rng.normal(0, 0.2, 4000) / count) * count, 3)
    assert lsb_of(values) == pytest.approx(1e-3, rel=1e-6)


@pytest.mark.parametrize(
    "many", [5, 6, 8, *(pytest.param(n, marks=pytest.mark.thorough) for n in (12, 40))]
)
def test_few_values_that_lie_on_no_grid_show_none(many: int) -> None:
    """Four gaps may be multiples of a step by chance, and of a part of it sooner."""
    rng = np.random.default_rng(4)
    shown = [lsb_of(rng.normal(size=many)) > 0 for _ in range(2000)]
    assert np.mean(shown) < (0.03 if many == 5 else 0.006)


@pytest.mark.parametrize(
    ("step", "decimals"),
    [(9.80665 / 2048, 4), (9.80665 / 2048, 5), (0.0010652644, 5), (0.0010652644, 6)],
)
def test_a_text_of_few_decimals_shows_the_step_of_wide_counts(
    step: float, decimals: int
) -> None:
    """The least gap is a percent off or two, and some lie thousands of steps apart."""
    rng = np.random.default_rng(7)
    near = np.unique(np.round(rng.normal(0.0, 300.0, 900)))
    far = np.cumsum(rng.integers(100, 5000, 20)) + near[-1]
    counts = np.concatenate([-far[::-1], near, far])
    written = np.round(step * counts, decimals)
    assert lsb_of(written) == pytest.approx(step, rel=1e-5)
