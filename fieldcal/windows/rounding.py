"""Errors of samples and of their mean from rounding to a step.

    U = q round(V / q),   V with noise s of its own, its mean anywhere within a step

If s is above half a step, rounding only adds to the variance of a sample,

    var U = s^2 + q^2 / 12                                                       (1)

If s is smaller, samples may not vary at all, though each has an error of q / sqrt(12),
rms; this is the least noise of a sample. The mean then has an error that averaging does
not reduce,

    var = sum over h = 1, 2, .. of (q / (pi h))^2 / 2 * exp(-4 pi^2 h^2 s^2 / q^2)   (2)

and at most that of a value anywhere within a step. If the noise is so low that only two
neighbouring values occur, one of them with frequency p, the error of the mean is
p - 1/2 - s Phi^-1(p) steps, with an unknown s (Phi is the distribution of a unit
normal). For s < 0.3 q the mean of its square is approximately

    var = (1 - 4 p (1 - p)) q^2 / 12,   p (1 - p) q^2 the variance of the values     (3)

The frequency f at which successive samples differ is an upper bound of their variance.
The variance is largest if the mean is in the middle of a step, and a fraction p / 2 of
the samples is one step to each side:

    var U <= p q^2,   f = 2 p - 3 p^2 / 2                                        (4)

Two means that are v apart lie at places in their steps that are v apart as well, so
that their errors have the covariance

    sum over h = 1, 2, .. of (q / (pi h))^2 / 2 * exp(-4 pi^2 h^2 s^2 / q^2)
                             * cos(2 pi h v / q)                                 (5)

Source: B. Widrow and I. Kollar, Quantization Noise, chapter 4; (3) to (5) are worked
out here.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array

WAVES = 5
"""Terms of (2); the remaining ones are assumed to decrease as the next one does."""

UNSURE = 3.6
"""Replaces the 4 of (3), to allow for the error of p (1 - p) in one window."""

FINE_NOISE_STEPS = 0.6
"""Noise of samples, in steps, below which single steps show."""


def least_deviation(step: Array) -> Array:
    """Least standard error of a sample, (c,), of outputs with these steps."""
    deviation: Array = np.asarray(step, dtype=float) / np.sqrt(12.0)
    return deviation


def noise_before_rounding(sampled: Array, step: Array) -> Array:
    """Noise before rounding, (c,), from the noise of the samples by (1)."""
    return np.sqrt(np.maximum(sampled**2 - least_deviation(step) ** 2, 0.0))


def variance_of_mean(step: Array, sampled: Array) -> Array:
    """Variance, (..., c), that rounding leaves in a mean of many values, (2).

    `sampled` is the deviation of the values at short lags.

    >>> still = variance_of_mean(np.array([1.0]), np.array([0.0]))
    >>> noisy = variance_of_mean(np.array([1.0]), np.array([0.5]))
    >>> np.sqrt([still[0], noisy[0]]).round(4)
    array([0.2887, 0.0084])
    """
    variance: Array = step**2 * _harmonics(step, sampled)[0].sum(axis=-1)  # (2)
    return variance


def covariance_of_two_means(step: float, sampled: float, apart: Array) -> Array:
    """Covariance, (...), of rounding errors of two means that differ by `apart`, (5).

    >>> covariance_of_two_means(1.0, 0.0, np.array([0.0, 0.5, 1.0])).round(3)
    array([ 0.083, -0.042,  0.083])
    """
    share = apart / step
    h = np.arange(1.0, WAVES + 1)
    cosines = np.cos(2 * np.pi * np.multiply.outer(share, h))
    whole = share - np.floor(share)
    waves, size = _harmonics(np.asarray(step), np.asarray(sampled))
    sawtooth = (whole**2 - whole + 1 / 6) / 2  # sum of all waves without noise
    rest = (sawtooth - cosines @ size[:-1]) * waves[-1] / size[-1]
    covariance: Array = step**2 * (cosines @ waves[:-1] + rest)  # (5)
    return covariance


def _harmonics(step: Array, sampled: Array) -> tuple[Array, Array]:
    """Terms of (2) for a step of one, (..., h), and their sizes (h,) without noise.

    The last term stands for all remaining ones.
    """
    h = np.arange(1.0, WAVES + 2)
    size = 1 / (2 * (np.pi * h) ** 2)
    size[-1] = 1 / 12 - size[:-1].sum()
    s = noise_before_rounding(sampled, step) / np.where(step > 0, step, 1.0)
    return size * np.exp(-((2 * np.pi * h * s[..., None]) ** 2)), size


def variance_of_few_values(step: Array, sampled: Array) -> Array:
    """Least variance, (..., c), of a mean if only two values may occur, (3)."""
    share = sampled / np.where(step > 0, step, 1.0)
    variance: Array = step**2 * np.maximum(0.0, 1 - UNSURE * share**2) / 12
    return variance


def largest_deviation(step: Array, changed: Array) -> Array:
    """Largest deviation of samples, (c,), of which a share `changed` differs, (4).

    It depends on how many samples differ, not on how much, so that an outlier counts
    once only. Where two of three differ, single steps no longer show.

    >>> largest_deviation(np.array([2.0]), np.array([0.0, 0.185, 1.0])).round(3)
    array([0.   , 0.632, 1.633])
    """
    p = (2 - np.sqrt(np.maximum(4 - 6 * changed, 0.0))) / 3
    return step * np.sqrt(p)


def visible_steps(step: Array, sampled: Array) -> Array:
    """Steps that the noise of the samples does not hide, (c,); 0 elsewhere."""
    return np.where(np.nan_to_num(sampled) < FINE_NOISE_STEPS * step, step, 0.0)
