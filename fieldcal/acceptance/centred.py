"""Outputs that somebody has centred: their mean is closer to zero than noise allows.

Means of n windows of an output with any offset at all, each with its error, have

    chi2 = sum over windows of (mean / sigma)^2,   P(chi2 or less; n)              (1)

where the smallest that chance makes is that of an offset of exactly zero. A device that
takes its gyroscopes' bias out while it rests leaves less than that, and so does a
program that takes the mean out of a whole recording, whose mean m of N samples with
noise s has

    P = erf(|m| sqrt(N) / (s sqrt(2)))                                             (2)

The offset that was taken out is then nowhere in the recording. Device axes, SI.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import erf

import numpy as np

from fieldcal.core.chances import chi2_tail
from fieldcal.core.samples import ACC, CHANNELS, GYR, Array, Block
from fieldcal.windows import Average

LEAST = 3
"""Windows below which three axes say too little, (1)."""


def biases_taken_out(
    windows: Sequence[Average], block: Block, least: float
) -> list[str]:
    """Sentences about biases that are not in the recording any more.

    Parameters
    ----------
    windows : at rest
    block : the whole recording
    least : probability below which it is no chance

    """
    said = []
    chance, what = tracked(windows)
    if chance < least:
        said.append(
            "the gyroscopes' means at rest lie closer to zero than their own noise"
            f" allows {what}: the device takes its bias out while it rests, so the"
            " recording does not hold it; switch that off (gyro bias estimation, auto"
            " calibration, zero velocity update), and record again"
        )
    odd = [name for name, p in centred(block) if p < least]
    if odd:
        said.append(
            f"the mean of the whole recording is zero in {', '.join(odd)}, closer than"
            " noise allows: whoever wrote it took the mean out, and the bias with it;"
            " record or export what the device sends"
        )
    return said


def tracked(windows: Sequence[Average]) -> tuple[float, str]:
    """Probability of gyroscopes' means so close to zero, (1), and what was seen.

    1 where they are further off than their noise, or too few were measured.
    """
    means = np.array([w.mean[GYR] for w in windows]).reshape(-1, 3)
    sigma = np.array([w.sigma[GYR] for w in windows]).reshape(-1, 3)
    seen = np.isfinite(means) & (sigma > 0)
    if (count := int(seen.sum())) < 3 * LEAST:
        return 1.0, ""
    chi2 = float(np.sum((means[seen] / sigma[seen]) ** 2))  # (1)
    chance = 1.0 - chi2_tail(chi2, count)
    return chance, f"(χ² about zero {chi2:.2g} of {count} means)"


def centred(block: Block) -> list[tuple[str, float]]:
    """Accelerometers by channel with the probability of their mean, (2)."""
    out = []
    for name, values in zip(CHANNELS[ACC], block.acc.T, strict=True):
        known = values[np.isfinite(values)]
        if len(known) > 2 and (noise := _noise(known)) > 0:
            off = abs(float(known.mean())) * np.sqrt(len(known) / 2) / noise
            out.append((name, erf(off)))  # (2)
    return out


def _noise(values: Array) -> float:
    return float(np.diff(values).std() / np.sqrt(2.0))
