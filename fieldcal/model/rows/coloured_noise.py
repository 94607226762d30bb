"""Noise of rows in motion as a function of frequency, from the residuals.

The noise is assumed stationary. Each channel has one power P_b in each band b of
frequencies. It follows from the residuals r of the rows after columns were fitted. With
n_b coefficients in a band, l_b the sum of their leverages, and L_b = ln P_b, the most
probable powers minimise

    sum_b (n_b - l_b) / 2 [L_b + d_b exp(-L_b)]
        + sum_b (L_b+1 - L_b)^2 / (2 STEEP^2 (x_b+1 - x_b))
        + sum_b (L_b - a - S_b)^2 / (2 UNLIKE^2)                                   (1)

with d_b = sum r^2 / (n_b - l_b), x the logarithm of the frequency, S_b the logarithm of
the power of all channels of the triad together, and a the difference of this channel
from it. The second and third term state that spectra are smooth and that the channels
of a triad have similar spectra, which matters in bands with few coefficients. With
s_b^2 the variance of L_b, the mean power is exp(L_b + s_b^2 / 2). The mean of the rows
has no residual, since the bias fits it. It is treated as half the lowest frequency: L
is extrapolated there, with the slope of a random walk at most. An error that correlates
with the motion and has no column is part of r at the frequencies of the motion, and so
increases the uncertainty of all that is estimated from these frequencies. Source:
restricted likelihood, Patterson and Thompson 1971; P. Whittle 1953.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model import detections, priors, resolutions, tolerances


@dataclass(frozen=True, slots=True)
class Bands:
    """Bands of frequencies in which the noise has a power each.

    Attributes
    ----------
    edges : (b + 1,) Hz, lowest frequency of each band, and the end
    place : (b + 1,) ln of half the lowest frequency, and of each band's middle

    """

    edges: Array
    place: Array

    @classmethod
    def between(cls, frequency: Array) -> Bands:
        """Bands of coefficients at frequencies (n,), Hz, some of them 0."""
        rising = np.sort(frequency[frequency > 0])
        starts, at = [0], 0
        while at < len(rising):
            end = int(
                np.searchsorted(
                    rising, rising[at] * resolutions.BAND_RATIO, side="right"
                )
            )
            end = max(end, at + resolutions.MIN_BAND_COEFFICIENTS)
            at = (
                len(rising)
                if len(rising) - end < resolutions.MIN_BAND_COEFFICIENTS
                else end
            )
            starts.append(at)
        middle = [float(np.mean(np.log(rising[a:b]))) for a, b in pairwise(starts)]
        edges = np.append(rising[starts[:-1]], np.inf)
        return cls(edges, np.array([float(np.log(rising[0] / 2)), *middle]))

    def levels(
        self, frequency: Array, left: Sequence[Array], leverage: Sequence[Array]
    ) -> list[Array]:
        """Ln P at each place of the channels of a triad, (b + 1,) each.

        Parameters
        ----------
        frequency : (n,) of the coefficients of a channel, Hz
        left : (n,) what is left of them, by channel
        leverage : (n,) of each, by channel

        """
        moves = np.flatnonzero(frequency > 0)
        of = np.searchsorted(self.edges, frequency[moves], side="right") - 1
        of, count = np.maximum(of, 0), len(self.edges) - 1
        free = np.array([np.bincount(of, 1 - h[moves], count) for h in leverage])
        free = np.maximum(free, tolerances.MIN_BAND_DOF)
        square = np.array([np.bincount(of, r[moves] ** 2, count) for r in left])
        raw = np.log(np.maximum(square / free, tolerances.MIN_POWER))
        loud = np.average(
            raw, axis=1, weights=np.minimum(free, resolutions.MIN_BAND_COEFFICIENTS)
        )
        even = (square * np.exp(-loud)[:, None]).sum(axis=0) / free.sum(axis=0)
        apart = np.diff(self.place[1:])
        shape = _smooth(
            np.log(np.maximum(even, tolerances.MIN_POWER)),
            free.sum(axis=0),
            apart,
            None,
        )
        channels = zip(raw, free, loud, strict=True)
        levels = [_smooth(own, dof, apart, shape + mean) for own, dof, mean in channels]
        return [self._with_mean_level(level) for level in levels]

    def _with_mean_level(self, level: Array) -> Array:
        """Levels with that of the mean before them."""
        near = self.place[1:] < self.place[1] + detections.SLOPE_REACH
        slope = 0.0
        if near.sum() > 1:
            slope = float(np.polyfit(self.place[1:][near], level[near], 1)[0])
        steep = np.clip(-slope, 0.0, detections.WALK_SLOPE) * (
            self.place[1] - self.place[0]
        )
        return np.concatenate([[level[0] + steep], level])

    def power(self, levels: Array, frequency: Array) -> Array:
        """P at some frequencies, (n,), of ln P at each place."""
        at = np.log(np.maximum(frequency, np.exp(self.place[0])))
        out: Array = np.exp(np.interp(at, self.place, levels))
        return out


def _smooth(raw: Array, free: Array, apart: Array, about: Array | None) -> Array:
    """Ln of the mean power of (1), (b,); `about` are a + S_b, where that is known."""
    stiff = 1 / (
        priors.NOISE_SLOPE**2 * np.maximum(apart, tolerances.MIN_LOG_FREQUENCY)
    )
    near = 0.0 if about is None else priors.NOISE_AXES_LOG_SPREAD**-2
    middle = raw if about is None else about
    level = middle.copy()
    inner = np.diag(np.append(stiff, 0.0) + np.append(0.0, stiff) + near)
    inner -= np.diag(stiff, 1) + np.diag(stiff, -1)
    bend = inner
    for _ in range(tolerances.MAX_ITERATIONS):
        ratio = np.exp(np.clip(raw - level, -20.0, 3.0))
        slope = free / 2 * (1 - ratio) + inner @ level - near * middle
        bend = inner + np.diag(free / 2 * np.maximum(ratio, 0.2))
        step = np.clip(np.linalg.solve(bend, slope), -2.0, 2.0)
        level = level - step
        if np.abs(step).max() < tolerances.ACCUMULATED_ROUNDING:
            break
    return level + np.diag(np.linalg.inv(bend)) / 2
