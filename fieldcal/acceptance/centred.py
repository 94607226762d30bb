"""Outputs without bias, since the device or a program has subtracted their mean.

Means of n windows of an output with an offset of exactly zero, each with the error that
white noise gives it, have

    chi2 = sum over windows of (mean / sigma)^2,   P(chi2 or less; n)              (1)

and gyroscopes whose biases return within s_b from run to run, and feel the Earth, come
so close to zero, with an error s of each axis over all windows, with a chance of

    P = product over axes of min(1, 4 s / (sqrt(2 pi) sqrt(s_b^2 + w_E^2 / 3)))    (2)

If a device removes the bias of its gyroscopes at rest, chi2 (1) is not significant, and
the product of (1) and (2) is the probability that this is chance. What a turn put out
is removed again in some seconds, so the means are c of

    W(t) = c + d exp(-t / tau)                                                     (5)

in each window, with the tau that all windows have the least residual with. The removal
also takes out slow noise, so sigma is that of the noise at all frequencies: the median
of the periodogram over ln 2.

If a program subtracts the mean of a whole recording of N samples with noise s, a mean
as small as the one that is left, m, has by chance the probability

    P = erf(|m| sqrt(N) / (s sqrt(2)))                                             (3)

The recording does not contain what was subtracted. If values are rounded to steps q
afterwards, the mean is larger: with windows that are parts f of all samples,

    m = q d +- s,   s^2 = noise^2 / N + q^2 / 12 sum f^2                           (4)

with d = 0 if values are rounded to the nearest step, -1/2 if they are rounded down, and
-1/2 times the mean of their signs if they are rounded toward zero; in windows that are
rounded to zero q is twice as large. Values that were on this grid before are all moved
by the same part of a step, so d = 0 and the sum in (4) is 1. For each of the four, the
probability follows from (1) and (2) over all axes, with s_b of accelerometers; the
least of them counts, times four (Bonferroni). Device axes, SI.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import erf

import numpy as np

from fieldcal.core.chances import chi2_tail
from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import ACC, CHANNELS, Array, Block
from fieldcal.physics.recording import grids_of
from fieldcal.windows import Average

LEAST = 2
"""Fewest windows for (1)."""

LAGS = np.geomspace(0.25, 16.0, 49)
"""Time constants that are tried, s."""

CELLS = 256
"""Most means of a window in which (5) is fitted."""

SPECTRUM = 16
"""Fewest samples for a periodogram."""


def biases_taken_out(
    windows: Sequence[Average],
    block: Block,
    repeat: tuple[float | Array, float],
    least: float,
) -> list[str]:
    """Sentences about biases that the recording no longer contains.

    Parameters
    ----------
    windows : at rest
    block : the whole recording
    repeat : spread of an accelerometer's and of a gyroscope's bias, 1 sigma, m/s^2 and
        rad/s: from run to run, and of accelerometers as large as it is found; (3,) or
        one for all
    least : probability below which chance is excluded

    """
    said = []
    chance, what = tracked(windows, block, repeat[1], least)
    if chance < least:
        said.append(
            "the gyroscopes' means at rest are zero within their noise, with neither a"
            f" bias nor the Earth's rate in them {what}: the device removes its bias"
            " at rest, so the recording does not contain it; switch this off (gyro"
            " bias estimation, auto calibration, zero velocity update) and record"
            " again"
        )
    odd = [name for name, p in centred(block) if p < least]
    if not odd and centred_and_rounded(windows, block, repeat[0], least) < least:
        odd = list(CHANNELS[ACC])
    if odd:
        said.append(
            f"the mean over the whole recording is closer to zero in {', '.join(odd)}"
            " than noise allows: the program that wrote it subtracted the mean, and the"
            " bias with it; record or export the raw output of the device"
        )
    return said


def tracked(
    windows: Sequence[Average], block: Block, repeat: float, least: float
) -> tuple[float, str]:
    """Probability of gyroscopes' means so close to zero, (1) (2), and chi2 in words.

    1 if they are significantly different from zero, or too few were measured.
    """
    means, sigma = _settled_means([block.between(w.start, w.end) for w in windows])
    seen = np.isfinite(means) & (sigma > 0)
    if (count := int(seen.sum())) < 3 * LEAST or not seen.any(axis=0).all():
        return 1.0, ""
    chi2, larger = _chi2_about_zero(means[seen], sigma[seen])
    if larger < least:
        return 1.0, ""
    info = np.where(seen, 1.0 / np.where(seen, sigma, 1.0) ** 2, 0.0).sum(axis=0)
    felt = float(np.hypot(repeat, EARTH_RATE / np.sqrt(3.0)))
    chance = (1.0 - larger) * _chance_near_zero(1 / np.sqrt(info), felt)
    return chance, f"(χ² about zero {chi2:.2g} of {count} means)"


def _chi2_about_zero(means: Array, sigma: Array) -> tuple[float, float]:
    """Chi-squared of means, and the probability of a larger one, (1)."""
    chi2 = float(np.sum((means / sigma) ** 2))
    return chi2, chi2_tail(chi2, len(means))


def _chance_near_zero(sigma: Array, spread: float | Array) -> float:
    """Probability that offsets of a spread come so close to zero on all axes, (2)."""
    return float(np.minimum(4 * sigma / np.sqrt(2 * np.pi) / spread, 1.0).prod())


def _settled_means(held: Sequence[Block]) -> tuple[Array, Array]:
    """What gyroscopes settle to in windows, c of (5), and its error, (w, 3) each."""
    cells = [_Cells.of(one) for one in held if len(one) >= SPECTRUM]
    if not cells:
        return np.empty((0, 3)), np.empty((0, 3))

    every = [[one.settled(lag) for one in cells] for lag in LAGS]
    left = [np.nansum([chi2 for _, _, chi2 in found]) for found in every]
    best = every[int(np.argmin(left))]
    return np.array([c for c, _, _ in best]), np.array([s for _, s, _ in best])


@dataclass(frozen=True, slots=True)
class _Cells:
    """Gyroscopes at rest in a window, as means of as many samples each.

    Attributes
    ----------
    t : (k,) s since the window began
    gyr : (k, 3) rad/s
    noise : (3,) rad/s, that white noise leaves in each mean

    """

    t: Array
    gyr: Array
    noise: Array

    @classmethod
    def of(cls, one: Block) -> _Cells:
        """The means of a window, at most `CELLS`.

        An exponential is in the mean of a cell as in its middle, but for a factor that
        all cells share.
        """
        each = -(-len(one) // CELLS)
        count = len(one) // each
        t, gyr = one.t[: count * each] - one.t[0], one.gyr[: count * each]
        level = _white_noise(one.gyr) / np.sqrt(each)
        means = gyr.reshape(count, each, 3).mean(axis=1)
        return cls(t.reshape(count, each).mean(axis=1), means, level)

    def settled(self, lag: float) -> tuple[Array, Array, Array]:
        """Get c of (5), its error, and chi2 of what is left (0 without noise)."""
        design = np.ones((len(self.t), 2))
        design[:, 1] = np.exp(-self.t / lag)
        inner = np.linalg.inv(design.T @ design)
        fit = inner @ (design.T @ self.gyr)
        left = ((self.gyr - design @ fit) ** 2).sum(axis=0)
        some = self.noise > 0
        chi2 = np.divide(left, self.noise**2, out=np.zeros(3), where=some)
        return fit[0], self.noise * np.sqrt(inner[0, 0]), chi2


def _white_noise(gyr: Array) -> Array:
    """Noise of a sample at all frequencies, (3,)."""
    power = np.abs(np.fft.rfft(gyr - gyr.mean(axis=0), axis=0)[1:-1]) ** 2
    level: Array = np.sqrt(np.median(power, axis=0) / len(gyr) / np.log(2.0))
    return level


def centred(block: Block) -> list[tuple[str, float]]:
    """Accelerometers by channel with the probability of their mean, (3)."""
    out = []
    for name, values in zip(CHANNELS[ACC], block.acc.T, strict=True):
        known = values[np.isfinite(values)]
        if len(known) > 2 and (noise := _noise(known)) > 0:
            off = abs(float(known.mean())) * np.sqrt(len(known) / 2) / noise
            out.append((name, erf(off)))  # (3)
    return out


def centred_and_rounded(
    windows: Sequence[Average], block: Block, repeat: float | Array, least: float
) -> float:
    """Probability that the means come so close to those that rounding leaves, (4).

    1 if values are not rounded to a grid, or differ significantly from these means.
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
        sigma = np.sqrt(noise + wide * step**2 / 12)  # (4)
        _, larger = _chi2_about_zero(mean - step * shift, sigma)
        if larger >= least:
            found.append((1.0 - larger) * _chance_near_zero(sigma, repeat))
    return min(len(ways) * min(found), 1.0)


def _noise(values: Array) -> float:
    return float(np.diff(values).std() / np.sqrt(2.0))
