"""Rounding of the outputs as the device states it, and the error of a mean from it.

For values rounded to the nearest multiple of a step q, the error of a mean is that of
`rounding`. For values that are rounded toward zero to k steps, and then shifted to the
middle of their interval, k + sign(k)/2 or 0, there is a further error d around zero,
where the interval is two steps wide:

    d(x) = -1/2 for 0 < x < 1, 1/2 for -1 < x < 0, 0 elsewhere                   (1)
    D(v, s) = E d(v + s n) = (2 P(0) - P(1) - P(-1)) / 2,  P(a) = Phi((a - v)/s) (2)

The mean of the values is v + D. It determines v to about a step, so the variance

    var = mean of D(u, s)^2 over |u - v| < 1                                     (3)

is added. Symbols: x, v true output and its mean in steps, s its noise in steps before
rounding, n standard normal, Phi its distribution. Without noise (3) and the rounding
make the variance 1/3 of a value that is anywhere within (-1, 1). Device axes, SI.
"""

from __future__ import annotations

from math import erf

import numpy as np

from fieldcal.core.samples import Array, Grain
from fieldcal.windows import rounding

MEAN_OFFSETS = np.linspace(-1.0, 1.0, 21)
"""Possible differences of the true mean from the mean of the values, steps."""

LEAST_NOISE = 1e-3
"""Least noise in (2), steps, so that it is not divided by zero."""

AROUND_ZERO = 2.0
"""Size of a mean below which it is around zero, steps."""

STEPS_HIDDEN_NOISE = 1.5
"""Noise, in steps, below which single steps show around zero."""


def rounding_variance(
    grain: Grain, mean: Array, sampled: Array, shown_steps: Array
) -> Array:
    """Variance that rounding leaves in a mean, (6,).

    Parameters
    ----------
    grain : rounding that the device states
    mean : (6,) of the values
    sampled : (6,) standard deviation of the values at short lags
    shown_steps : (6,) steps as the values show them, where the device states none

    """
    q = np.where(grain.step > 0, grain.step, shown_steps)
    few = rounding.variance_of_few_values(grain.step, sampled)
    rounded = np.maximum(rounding.variance_of_mean(q, sampled), few)
    if not grain.cut:
        return rounded
    per = np.where(grain.step > 0, grain.step, 1.0)
    own = rounding.noise_before_rounding(sampled, q)
    zone = _variance_around_zero(np.nan_to_num(mean) / per, own / per)
    return rounded + np.where(grain.step > 0, grain.step**2 * zone, 0.0)


def visible_step(grain: Grain, mean: Array, sampled: Array) -> Array:
    """Largest jump between neighbouring values that noise does not hide, (6,).

    0 if noise hides it, or if the steps are unknown. Arguments as `rounding_variance`.
    """
    q = grain.step
    fine = rounding.visible_steps(q, sampled)
    if not grain.cut:
        return fine
    around = (np.abs(np.nan_to_num(mean)) < AROUND_ZERO * q) & (
        sampled < STEPS_HIDDEN_NOISE * q
    )
    return np.where(around, 2 * q, fine)


def _variance_around_zero(mean: Array, noise: Array) -> Array:
    """Variance from the wide step around zero, (3), in steps, (c,)."""
    variance = np.zeros(len(mean))
    for i in np.flatnonzero(np.abs(mean) < AROUND_ZERO + 3 * noise):
        s = max(float(noise[i]), LEAST_NOISE)
        variance[i] = np.mean(
            [_offset_of_cut_values(mean[i] + u, s) ** 2 for u in MEAN_OFFSETS]
        )  # (3)
    return variance


def _offset_of_cut_values(v: float, s: float) -> float:
    """Error of the mean of values rounded toward zero, (2), in steps."""
    below, at, above = (0.5 * (1 + erf((a - v) / (s * 2**0.5))) for a in (-1, 0, 1))
    return (2 * at - above - below) / 2
