"""Detects outputs from which the device or a program has subtracted the mean.

If a program subtracts the mean of a whole recording of N samples with noise s, a mean
as small as the one that is left, m, has by chance the probability

    P = erf(|m| sqrt(N) / (s sqrt(2)))                                             (1)

The recording does not contain what was subtracted. If values are rounded to steps q
afterwards, the mean is larger: with windows that are parts f of all samples,

    m = q d +- s,   s^2 = noise^2 / N + q^2 / 12 sum f^2                           (2)

with d = 0 if values are rounded to the nearest step, -1/2 if they are rounded down, and
-1/2 times the mean of their signs if they are rounded toward zero; in windows that are
rounded to zero q is twice as large. Values that were on this grid before are all moved
by the same part of a step, so d = 0 and the sum in (2) is 1. For each of the four, if
biases repeat within s_b from run to run, means come so near over all axes with

    chi2 = sum ((m - q d) / s)^2
    P = P(chi2 or less) prod min(1, 4 s / (sqrt(2 pi) s_b))                        (3)

and the least of them counts, times four (Bonferroni).

Later changes of the samples, such as interpolation, move a mean slightly. If no mean
was subtracted, m is the sum of the mean force and the bias b. For m to be so small, the
mean force has to be near -b. For any normal distribution of the mean force about zero,
the probability of that on each axis is at most

    x = 2 |m| / (sqrt(2 pi e) |b|),   P = x (1 + L + L^2 / 2),   L = -ln x          (4)

with x in P the product over axes, as that of three numbers drawn evenly from 0 to 1.
Device axes, SI.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import e, erf, log, pi, sqrt

import numpy as np

from fieldcal.acceptance.bias_cases import BiasSpread
from fieldcal.acceptance.bias_removal import (
    DOUBT,
    UNKNOWN,
    bias_removal_probability,
)
from fieldcal.core.probability import chi2_tail
from fieldcal.core.samples import ACC, CHANNELS, Array, Block
from fieldcal.physics.recording import grids_of
from fieldcal.windows import Average


def removed_bias_sentences(
    windows: Sequence[Average],
    block: Block,
    repeat: tuple[float, BiasSpread],
    seen: Array,
    least: float,
    gyro_biases: tuple[Array, Array] = (UNKNOWN, UNKNOWN),
) -> list[str]:
    """Sentences about biases that were subtracted from the recording.

    Parameters
    ----------
    windows : windows at rest
    block : the whole recording
    repeat : spread of an accelerometer's bias from run to run, 1 sigma, m/s^2, and of a
        gyroscope's
    seen : (3,) estimated biases of the accelerometers, m/s^2; 0 if there is none
    least : probability below which chance is excluded
    gyro_biases : estimated biases of the gyroscopes and their errors, rad/s, (3,) each

    """
    said = []
    removes, what = bias_removal_probability(windows, block, repeat[1], gyro_biases)
    if removes > DOUBT:
        said.append(
            "the gyroscopes' rates at rest are zero within their noise or return to"
            f" zero, so that no bias stays in them ({what}): the device removes its"
            " bias at rest, so the recording does not contain it; switch this off"
            " (gyro bias estimation, auto calibration, zero velocity update) and record"
            " again; if you know that it does no such thing, state it"
            " (--keeps-gyro-bias of run and import, keeps_gyro_bias = true under"
            " [device] in session.toml)"
        )
    odd = [name for name, p in mean_probabilities(block) if p < least]
    spread = np.hypot(repeat[0], seen)
    if not odd and (
        rounded_mean_probability(windows, block, spread, least) < least
        or altered_mean_probability(block, seen) < least
    ):
        odd = list(CHANNELS[ACC])
    if odd:
        said.append(
            f"the mean over the whole recording is closer to zero in {', '.join(odd)}"
            " than noise allows: the program that wrote it subtracted the mean, and the"
            " bias with it; record or export the raw output of the device"
        )
    return said


def mean_probabilities(block: Block) -> list[tuple[str, float]]:
    """Probability (1) of a mean as small as this one by chance, by channel."""
    out = []
    for name, values in zip(CHANNELS[ACC], block.acc.T, strict=True):
        known = values[np.isfinite(values)]
        if len(known) > 2 and (noise := _noise(known)) > 0:
            off = abs(float(known.mean())) * np.sqrt(len(known) / 2) / noise
            out.append((name, erf(off)))  # (1)
    return out


def rounded_mean_probability(
    windows: Sequence[Average], block: Block, repeat: float | Array, least: float
) -> float:
    """Probability that means are so close to those left by rounding by chance, (3).

    1 if values are not rounded to a grid, or if the means differ significantly.
    """
    step = grids_of(block)[:3]
    held = [block.between(w.start, w.end).acc for w in windows]
    held = [acc for acc in held if len(acc)]
    if not (step > 0).all() or not held or not np.isfinite(block.acc).all():
        return 1.0
    part = np.array([len(acc) for acc in held])[:, None] / len(block)
    zero = np.abs([acc.mean(axis=0) for acc in held]) < step / 2
    white = np.array([np.diff(acc, axis=0).var(axis=0) / 2 / len(acc) for acc in held])
    mean, signs = block.acc.mean(axis=0), np.sign(block.acc).mean(axis=0)
    noise, own = (part**2 * white).sum(axis=0), (part**2).sum(axis=0)
    to_zero = (part**2 * (1.0 + 3.0 * zero)).sum(axis=0)
    ways = ((0.0, own), (-0.5, own), (-signs / 2, to_zero), (0.0, 1.0))
    found = [1.0]
    for shift, wide in ways:
        sigma = np.sqrt(noise + wide * step**2 / 12)  # (2)
        larger = _chance_of_more(mean - step * shift, sigma)
        if larger >= least:
            found.append((1.0 - larger) * _chance_near_zero(sigma, repeat))  # (3)
    return min(len(ways) * min(found), 1.0)


def _chance_of_more(means: Array, sigma: Array) -> float:
    """Probability of a larger chi-squared than that of means about zero."""
    return chi2_tail(float(np.sum((means / sigma) ** 2)), len(means))


def _chance_near_zero(sigma: Array, spread: float | Array) -> float:
    """Probability that offsets of a spread come so close to zero on all axes."""
    return float(np.minimum(4 * sigma / np.sqrt(2 * np.pi) / spread, 1.0).prod())


def altered_mean_probability(block: Block, seen: Array) -> float:
    """Probability that the force cancels biases of this size on all axes, (4)."""
    known = np.isfinite(block.acc)
    if not known.any(axis=0).all():
        return 1.0
    mean = np.abs(np.nanmean(block.acc, axis=0))
    density = 1 / (sqrt(2 * pi * e) * np.maximum(np.abs(seen), 1e-300))
    x = max(float(np.minimum(2 * mean * density, 1.0).prod()), 1e-300)
    return min(x * (1 - log(x) + log(x) ** 2 / 2), 1.0)  # (4)


def _noise(values: Array) -> float:
    return float(np.diff(values).std() / np.sqrt(2.0))
