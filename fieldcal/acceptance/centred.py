"""Outputs that somebody has centred: they hold neither bias nor the Earth's rate.

Means of n windows of an output with an offset of exactly zero, each with the error that
white noise gives it, have

    chi2 = sum over windows of (mean / sigma)^2,   P(chi2 or less; n)              (1)

and gyroscopes whose biases return within s_b from run to run, and feel the Earth, come
so close to zero, with an error s of each axis over all windows, with a chance of

    P = product over axes of min(1, 4 s / (sqrt(2 pi) sqrt(s_b^2 + w_E^2 / 3)))    (2)

A device that takes its gyroscopes' bias out while it rests leaves nothing that stands
out of (1), and the product of (1) and (2) tells it from chance. It takes some seconds
to settle after a turn, so the second half of each window counts, and it takes slow
noise out with the bias, so sigma is that of the noise at all frequencies: the median of
its periodogram over ln 2.

A program that takes the mean out of a whole recording, whose mean m of N samples has
noise s, leaves

    P = erf(|m| sqrt(N) / (s sqrt(2)))                                             (3)

The offset that was taken out is then nowhere in the recording. Device axes, SI.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import erf

import numpy as np

from fieldcal.core.chances import chi2_tail
from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import ACC, CHANNELS, Array, Block
from fieldcal.windows import Average

LEAST = 2
"""Windows below which three axes say too little, (1)."""

SPECTRUM = 16
"""Samples below which there is no spectrum to speak of."""


def biases_taken_out(
    windows: Sequence[Average], block: Block, repeat: float, least: float
) -> list[str]:
    """Sentences about biases that are not in the recording any more.

    Parameters
    ----------
    windows : at rest
    block : the whole recording
    repeat : from run to run of a gyroscope's bias, 1 sigma, rad/s
    least : probability below which it is no chance

    """
    said = []
    chance, what = tracked(windows, block, repeat, least)
    if chance < least:
        said.append(
            "the gyroscopes' means at rest are zero within their noise, with neither a"
            f" bias nor the Earth's rate in them {what}: the device takes its bias out"
            " while it rests, so the recording does not hold it; switch that off (gyro"
            " bias estimation, auto calibration, zero velocity update), and record"
            " again"
        )
    odd = [name for name, p in centred(block) if p < least]
    if odd:
        said.append(
            f"the mean of the whole recording is zero in {', '.join(odd)}, closer than"
            " noise allows: whoever wrote it took the mean out, and the bias with it;"
            " record or export what the device sends"
        )
    return said


def tracked(
    windows: Sequence[Average], block: Block, repeat: float, least: float
) -> tuple[float, str]:
    """Probability of gyroscopes' means so close to zero, (1) (2), and what was seen.

    1 where they stand out of their noise, or too few were measured.
    """
    halves = [_settled(block, w) for w in windows]
    means = np.array([mean for mean, _ in halves]).reshape(-1, 3)
    sigma = np.array([error for _, error in halves]).reshape(-1, 3)
    seen = np.isfinite(means) & (sigma > 0)
    if (count := int(seen.sum())) < 3 * LEAST or not seen.any(axis=0).all():
        return 1.0, ""
    chi2 = float(np.sum((means[seen] / sigma[seen]) ** 2))  # (1)
    larger = chi2_tail(chi2, count)
    if larger < least:
        return 1.0, ""
    info = np.where(seen, 1.0 / np.where(seen, sigma, 1.0) ** 2, 0.0).sum(axis=0)
    felt = float(np.hypot(repeat, EARTH_RATE / np.sqrt(3.0)))
    small = np.minimum(4 / np.sqrt(2 * np.pi * info) / felt, 1.0)  # (2)
    chance = (1.0 - larger) * float(small.prod())
    return chance, f"(χ² about zero {chi2:.2g} of {count} means)"


def _settled(block: Block, window: Average) -> tuple[Array, Array]:
    """Mean of the gyroscopes in the second half of a window, (3,), and its error."""
    middle = (window.start + window.end) / 2
    gyr = block.between(middle, window.end).gyr
    mean = gyr.mean(axis=0) if len(gyr) else np.full(3, np.nan)
    if len(gyr) < SPECTRUM:
        return mean, np.zeros(3)
    power = np.abs(np.fft.rfft(gyr - mean, axis=0)[1:-1]) ** 2
    level = np.median(power, axis=0) / len(gyr) / np.log(2.0)
    return mean, np.sqrt(level / len(gyr))


def centred(block: Block) -> list[tuple[str, float]]:
    """Accelerometers by channel with the probability of their mean, (3)."""
    out = []
    for name, values in zip(CHANNELS[ACC], block.acc.T, strict=True):
        known = values[np.isfinite(values)]
        if len(known) > 2 and (noise := _noise(known)) > 0:
            off = abs(float(known.mean())) * np.sqrt(len(known) / 2) / noise
            out.append((name, erf(off)))  # (3)
    return out


def _noise(values: Array) -> float:
    return float(np.diff(values).std() / np.sqrt(2.0))
