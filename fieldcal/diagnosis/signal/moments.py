"""Amplitudes of a wave, in each window or in stretches of it.

    A = 2/n sum_k s_k exp(-2 pi i hz t_k)                                           (1)

with variance 4 sigma^2 / n for white noise of sigma. Sums over a few parts of each
window are stored, so that A at a slightly different frequency is a sum over the parts.
Source: D. Rife, R. Boorstyn, Single-tone parameter estimation, 1974.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fieldcal.core.samples import Array, Index, Mask
from fieldcal.diagnosis.signal.pieces import Complex, WindowSamples
from fieldcal.model import resolutions


@dataclass(frozen=True, slots=True)
class Moments:
    """Sums of the samples times a wave of frequency `near`, over parts of windows.

    Attributes
    ----------
    near : Hz
    sums : (k, 6)
    middle : (k,) s, mean time of each part
    bound : (g + 1,) first part of each group, a window or a stretch of one
    window : (g,) of each group
    counts : (g,) samples

    """

    near: float
    sums: Complex
    middle: Array
    bound: Index
    window: Index
    counts: Array

    def amplitudes(self, offset: Array) -> Complex:
        """Amplitudes (o, g, 6) of each group at `near` plus `offset` (o,), Hz."""
        wave = np.exp(-2j * np.pi * offset[:, None] * self.middle)
        parts = [wave[:, a:b] @ self.sums[a:b] for a, b in pairwise(self.bound)]
        amplitude: Complex = 2 / self.counts[:, None] * np.stack(parts, axis=1)
        return amplitude

    def select(self, groups: Mask) -> Moments:
        """The moments of some groups only, `groups` (g,)."""
        size = np.diff(self.bound)
        parts = np.repeat(groups, size)
        return Moments(
            self.near, self.sums[parts], self.middle[parts],
            np.append(0, np.cumsum(size[groups])), self.window[groups],
            self.counts[groups],
        )  # fmt: skip


def moments_of(pieces: WindowSamples, near: float, stretches: int = 1) -> Moments:
    """Sums over windows, each divided into stretches that are groups of their own."""
    sums, middle, bound = [], [], [0]
    counts: list[float] = []
    for samples, t in zip(pieces.samples, pieces.times, strict=True):
        for first, last in pairwise(_part_bounds(0, len(t), stretches)):
            most = resolutions.PARTS_PER_WINDOW * max(
                (last - first) // resolutions.PERIODOGRAM_SAMPLES, 1
            )
            parts = min(most, max((last - first) // resolutions.MIN_PART_SAMPLES, 1))
            for a, b in pairwise(_part_bounds(first, last, parts)):
                turned = 2 * np.pi * near * t[a:b]
                real, imaginary = (
                    np.stack([np.cos(turned), np.sin(turned)]) @ (samples[a:b])
                )
                sums.append(real - 1j * imaginary)
                middle.append(t[a:b].mean())
            bound.append(len(sums))
            counts.append(float(last - first))
    window = np.repeat(np.arange(len(pieces.samples)), stretches)
    return Moments(
        near, np.array(sums), np.array(middle), np.array(bound), window,
        np.array(counts),
    )  # fmt: skip


def _part_bounds(first: int, last: int, parts: int) -> list[int]:
    """Bounds of parts of nearly equal length, the longer ones first."""
    each, more = divmod(last - first, parts)
    return [first + i * each + min(i, more) for i in range(parts + 1)]
