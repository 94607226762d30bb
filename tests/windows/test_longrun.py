"""The error of a mean against the error made, and its formulas against slow ones."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fieldcal.core.samples import Array
from fieldcal.windows.longrun import error_of_mean
from windows.signals import flicker, low_passed, markov, white


def pulls(source: Callable[..., Array], channels: int = 900) -> Array:
    """Difference of neighbouring 30 s means over its stated error."""
    cells = []
    for seed in range(channels // 300):
        x = source(np.random.default_rng(seed), 6000, 300)
        cells.append(x.reshape(600, 10, 300).mean(axis=1))
    y = np.hstack(cells)
    a, b = (error_of_mean(part, 0.1).covariance for part in (y[:300], y[300:]))
    return np.asarray(
        (y[:300].mean(axis=0) - y[300:].mean(axis=0)) / np.sqrt(np.diag(a) + np.diag(b))
    )


@pytest.mark.statistical
@pytest.mark.parametrize(
    ("source", "least", "most"),
    [
        (white, 0.90, 1.04),
        (low_passed(20), 0.90, 1.04),
        (low_passed(5), 0.90, 1.04),
        (markov(0.5), 0.90, 1.04),
        (markov(0.95), 0.70, 1.0),
        (flicker(1.0), 0.80, 1.1),
    ],
)
def test_the_error_stated_is_the_error_made(
    source: Callable[..., Array], least: float, most: float
) -> None:
    found = pulls(source)
    assert least < found.std() < most
    assert np.mean(np.abs(found) > 1.96) < 0.075
