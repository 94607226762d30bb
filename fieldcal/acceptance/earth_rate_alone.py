"""How likely rates at rest are if the gyroscopes show nothing but the Earth's rate.

Its direction is another one in each window, and unknown. The mean m of a window over
three axes, with noise of variance s^2 each, has the density, beside the Earth's rate w,

    exp(-(|m|^2 + w^2) / 2 s^2) sinh(x) / x,    x = |m| w / s^2                    (1)

times that of noise of the samples about their own mean.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.acceptance.rest_steps import RestStep
from fieldcal.acceptance.tracked_bias import SENT_AFTER
from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import Array


def earth_rate_alone(steps: Sequence[RestStep], density: Array, blind: float) -> float:
    """Log likelihood of all means, as `log_likelihoods` has it; -inf without 3 axes.

    Parameters
    ----------
    steps : of rest
    density : (3,) spectral density of the white noise, (rad/s)^2 s
    blind : time after each turn of which nothing is used, s

    """
    if len(density) < 3:
        return -np.inf
    found, window = 0.0, list[RestStep]()
    for step in [*steps, RestStep(0.0, 0.0, np.full(3, np.nan), turned=True)]:
        if step.turned:
            found += _of_window(window, density)
            window = []
        if step.since_turn >= blind and np.isfinite(step.rates).all():
            window.append(step)
    return found


def _of_window(window: Sequence[RestStep], density: Array) -> float:
    """Log likelihood of means between two turns, of equal length each."""
    if not window:
        return 0.0
    rates = np.array([step.rates for step in window])
    var = density * (1 + SENT_AFTER) / window[0].seconds
    mean = rates.mean(axis=0)
    about = -0.5 * float(np.sum(np.log(var) + (rates - mean) ** 2 / var))
    s2 = float(var.mean()) / len(rates)
    size = float(np.linalg.norm(mean))
    x = max(size * EARTH_RATE / s2, 1e-9)
    ways = x + np.log(-np.expm1(-2 * x) / (2 * x))  # of sinh(x) / x
    return about - (size**2 + EARTH_RATE**2) / (2 * s2) + float(ways)  # (1)
