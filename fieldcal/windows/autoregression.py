"""How much of the previous output each sample of a device at rest keeps.

Outputs y that keep a share k of the previous one are an autoregressive process of first
order about their mean,

    y_n = k y_(n-1) + (1 - k) x_n                                                   (1)

and go to that mean by a factor k a sample if they were elsewhere. What is added in each
sample, e_n = y_n - k y_(n-1), is correlated over a few samples alone: by rounding, and
by the filter of the sensor. So an older sample z stands in for y_(n-1) (an instrumental
variable), and k = sum z y_n / sum z y_(n-1), each about its mean over the window. This
mean follows its own noise, which makes k smaller; with V the variance of a mean of e
times its length,

    sum (z - mean) e_n = -V / (1 - k) on average                                    (2)

Source: M. G. Kendall, Note on bias in the estimation of autocorrelation, 1954, for (2);
O. Reiersol 1941 for the instruments.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array

OWN_SAMPLES = 5
"""Memory of what is added in each sample, such as of a sensor's own filter, samples."""

SURELY = 5.0
"""Standard errors by which a window differs."""

LEAST_SHARE = 0.02
"""Least variance of means of what is added, as a share of that of single ones."""


@dataclass(frozen=True, slots=True)
class Share:
    """Share k of the previous output that is kept, and its standard uncertainty."""

    kept: float
    sigma: float

    @property
    def samples(self) -> float:
        """Time constant, samples."""
        return float(-1 / np.log(self.kept))

    @property
    def samples_sigma(self) -> float:
        """Standard uncertainty of the time constant, samples."""
        return self.sigma * self.samples**2 / self.kept


@dataclass(frozen=True, slots=True)
class RestSums:
    """Products of the samples of one rest, each less their mean; (k,) each.

    Attributes
    ----------
    later, before : of the instrument with y_n and with y_(n-1)
    square : of the instrument with itself
    y : (m, k) outputs

    """

    later: Array
    before: Array
    square: Array
    y: Array

    @classmethod
    def of(cls, y: Array) -> RestSums:
        """Sums of the outputs at rest, (m, k)."""
        back = OWN_SAMPLES + 1
        z, old, new = (
            part - part.mean(axis=0) for part in (y[:-back], y[back - 1 : -1], y[back:])
        )
        return cls((z * new).sum(axis=0), (z * old).sum(axis=0), (z**2).sum(axis=0), y)

    def added(self, kept: float) -> Array:
        """What is added in each sample, about its mean, (m - 1, k)."""
        new = self.y[1:] - kept * self.y[:-1]
        out: Array = new - new.mean(axis=0)
        return out


def share_kept(rests: Sequence[RestSums], near: Share | None = None) -> Share | None:
    """One k of all rests and outputs; None if it is none between 0 and 1.

    Rests whose own k differs from `near` by more than chance are left out: the device
    is not at rest there.
    """
    later, before, square = (
        np.array([getattr(rest, name) for rest in rests]).reshape(len(rests), -1)
        for name in ("later", "before", "square")
    )
    own = later[before > 0] / before[before > 0]
    kept, sigma = near.kept if near else float(np.median([0.0, *own])), 0.0
    for _ in range(2):
        if not 0 < kept < 1:
            return None
        each = [mean_variance([rest.added(kept)]) for rest in rests]
        spread = np.median(each, axis=0)  # of most, as some may not be at rest
        known = (before > 0) & (spread > 0)
        right = later + spread / (1 - kept)  # (2)
        if near:
            own = right / np.where(known, before, 1.0)
            of_own = spread * square / np.where(known, before, 1.0) ** 2
            known &= np.abs(own - kept) < SURELY * np.sqrt(of_own + near.sigma**2)
        weight = known / np.where(spread > 0, spread, 1.0)
        total = float((weight * before).sum())
        if not total:
            return None
        kept = float((weight * right).sum() / total)
        sigma = float(np.sqrt((weight * square).sum())) / total
    return Share(kept, sigma) if 0 < kept < 1 else None


def mean_variance(added: Sequence[Array], lags: int = OWN_SAMPLES) -> Array:
    """Variance of a mean of what is added, times its length, (k,): V of (2).

    `lags` are the samples over which it is correlated.
    """
    beside = autocovariance(added, lags)
    total: Array = beside[0] + 2 * beside[1:].sum(axis=0)
    out: Array = np.maximum(total, LEAST_SHARE * beside[0])
    return out


def autocovariance(added: Sequence[Array], lags: int) -> Array:
    """Mean products of samples 0 to `lags` apart, (lags + 1, k)."""
    total = np.zeros((lags + 1, added[0].shape[1]))
    for e in added:
        # that of its power spectrum; zeros behind it keep its end from its beginning
        size = 1 << (len(e) + lags).bit_length()
        power = np.abs(np.fft.rfft(e, size, axis=0)) ** 2
        total += np.fft.irfft(power, size, axis=0)[: lags + 1]
    out: Array = total / sum(len(e) for e in added)
    return out
