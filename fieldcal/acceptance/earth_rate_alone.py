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
from fieldcal.acceptance.tracked_bias import NO_TIME, SENT_AFTER
from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import Array


def earth_rate_alone(steps: Sequence[RestStep], density: Array, blind: float) -> Array:
    """Log likelihood of all means, as `log_likelihoods` has it; -inf without 3 axes.

    Parameters
    ----------
    steps : of rest; results have the leading axes of their rates
    density : (3,) spectral density of the white noise, (rad/s)^2 s
    blind : time after each turn of which nothing is used, s

    """
    if len(density) < 3:
        return np.array(-np.inf)
    found, window = np.zeros(()), list[RestStep]()
    for step in [*steps, RestStep(0.0, 0.0, np.full(3, np.nan), turned=True)]:
        if step.turned and window:
            found = found + _of_window(window, density, blind)
            window = []
        if np.isfinite(step.rates).any():
            window.append(step)
    return found


def _of_window(window: Sequence[RestStep], density: Array, blind: float) -> Array:
    """Log likelihood of means between two turns; 0 if none is used."""
    rates, white = np.array([step.rates for step in window]), density * (1 + SENT_AFTER)
    late = [np.where(s.since_turn >= blind, s.seconds, 0.0) for s in window]
    known = np.isfinite(rates).all(axis=-1, keepdims=True)
    time = np.where(known, [np.broadcast_to(s, known.shape[1:]) for s in late], 0.0)
    rates = np.where(time > 0, rates, 0.0)
    total = np.maximum(time.sum(axis=0), NO_TIME)
    mean = (time * rates).sum(axis=0) / total
    var = white / np.where(time > 0, time, white)  # 1 if it is not used
    about = np.log(var) + np.where(time > 0, (rates - mean) ** 2 / var, 0.0)
    s2 = white.mean() / total[..., 0]
    size: Array = np.linalg.norm(mean, axis=-1)
    x = np.maximum(size * EARTH_RATE / s2, 1e-9)
    ways = x + np.log(-np.expm1(-2 * x) / (2 * x))  # of sinh(x) / x
    found: Array = ways - (size**2 + EARTH_RATE**2) / (2 * s2)  # (1)
    found -= 0.5 * about.sum(axis=(0, -1))
    return found
