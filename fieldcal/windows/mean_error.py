"""The covariance of a mean whose noise is not white, from the window's own data.

    I_j = |sum y_i exp(-i 2 pi f_j t_i)|^2 / m            periodogram of m cell means
    S   = w g                                             level w times a shape g
    g   = 1 / (1 + (f/c)^2) + k/f    or    1 + (r/f)^2                           (1)
    log p(g | I) = log p(g) - sum log g_j - n log Q,  Q = sum I_j / g_j          (2)
    v(g) = 1 - (d/2)(3 - 4 exp(-1/d) + exp(-2/d)) + 4 ln2 k T,  d = 1/(2 pi c T) (3)
    v(g) = 1 + (4/3) (pi r T)^2                                                  (4)
    var  = sum over g of p(g | I) * Q / (n - 1) * v(g) / m                       (5)

The noise is white, low-passed with the corner c, flicker with the knee k, or a random
walk with the knee r, Hz. The probability of each shape follows from Whittle's
likelihood with the level w integrated out (2). The variance (5) of the mean is averaged
over the shapes, so it is larger if the window is too short to distinguish them. (3) and
(4) are the Allan variance at the length T of the window in units of white noise: the
stated error is the difference to the mean of the next window, over sqrt(2). For white
and low-passed noise this is the standard error. Flicker and random walk also vary at
frequencies below 1/T, which the window does not show. A knee below about 3/T is hidden
by the white noise of one window, but several windows of a device show it together; the
shapes estimated from one window can therefore be passed to the next.

Sources: Whittle 1953; IEEE 952-1997 annex C (Allan variances).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from fieldcal.core.samples import Array

BAND = 2.5
"""Highest frequency the noise at f = 0 is estimated from, Hz."""

_FEWEST = 8
"""Least number of frequencies that are used, even if they are above `BAND`."""

_LINE = 8.0
"""Ratio of power to that of the neighbours above which a frequency is a line."""

_NEIGHBOURS = 10
"""Number of neighbouring frequencies on each side."""

CORNERS = (np.inf, 2.4, 1.2, 0.6, 0.3, 0.15)
KNEES = (0.0, 0.02, 0.06, 0.2, 0.6, 2.0, 6.0)
WALKS = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0)
"""Corners c, knees k and r of the shapes, Hz."""

PRIOR_LOWPASS = 0.08
PRIOR_FLICKER = 0.03
PRIOR_WALK = 0.002
"""Prior probabilities for an unknown device; the rest is white noise."""


@dataclass(frozen=True, slots=True)
class SpectrumShapes:
    """The family of spectra: (s,) corner, knee and walk of each, Hz, and log prior."""

    corner: Array
    knee: Array
    walk: Array
    log_prior: Array

    def spectra(self, f: Array) -> Array:
        """Spectra over white noise at the frequencies f (n,), Hz: (s, n), (1)."""
        low = 1 / (1 + (f / self.corner[:, None]) ** 2)
        g: Array = low + self.knee[:, None] / f + (self.walk[:, None] / f) ** 2  # (1)
        return g

    def variance(self, seconds: float) -> Array:
        """Variance of a mean over white noise, (s,), (3) and (4)."""
        d = 1 / (2 * np.pi * self.corner * seconds)
        # exp(-1/d) is 0 for white noise, where d is 0
        once, twice = (np.exp(-h * 2 * np.pi * self.corner * seconds) for h in (1, 2))
        markov = 1 - d / 2 * (3 - 4 * once + twice)  # (3)
        flicker = 4 * np.log(2) * self.knee * seconds  # (3)
        walk = 4 / 3 * (np.pi * self.walk * seconds) ** 2  # (4)
        total: Array = markov + flicker + walk
        return total


def _shape_family() -> SpectrumShapes:
    rows = []
    for (a, c), (b, k) in product(enumerate(CORNERS), enumerate(KNEES)):
        low = PRIOR_LOWPASS / (len(CORNERS) - 1) if a else 1 - PRIOR_LOWPASS
        slow = PRIOR_FLICKER / (len(KNEES) - 1) if b else 1 - PRIOR_FLICKER
        rows.append((c, k, 0.0, (1 - PRIOR_WALK) * low * slow))
    rows += [(np.inf, 0.0, r, PRIOR_WALK / len(WALKS)) for r in WALKS]
    corner, knee, walk, prior = np.array(rows).T
    return SpectrumShapes(corner, knee, walk, np.log(prior))


SHAPES = _shape_family()


def log_likelihood(power: Array, shape: Array) -> tuple[Array, Array]:
    """Return log p(I | g) (s, c) and Q (s, c) of (2) for power (n, c), shape (s, n)."""
    q = (1 / shape) @ power
    level = np.log(np.where(q > 0, q, 1.0))
    log_likelihood: Array = -np.log(shape).sum(axis=1)[:, None] - len(power) * level
    return log_likelihood, q  # (2)


def fourier_sums(means: Array, spacing: float) -> tuple[Array, Array]:
    """Frequencies (n,), Hz, and Fourier sums (n, c) over sqrt(m) of cells (m, c)."""
    m = len(means)
    top = max(BAND * spacing * m, _FEWEST)
    last = int(min(top, (m - 1) // 2))
    f = np.arange(1, last + 1) / (m * spacing)
    return f, np.fft.rfft(means, axis=0)[1 : last + 1] / np.sqrt(m)


def without_lines(power: Array) -> Array:
    """Power (n, c) in which lines are limited to a multiple of the power around them.

    Hum and sway average out and must not count as noise. The lowest four frequencies
    are not changed, since a drift is no line.
    """
    if len(power) <= 2 * _NEIGHBOURS:
        return power
    width = 2 * _NEIGHBOURS + 1
    padded = np.pad(power, ((width // 2, width // 2), (0, 0)), mode="reflect")
    local = np.lib.stride_tricks.sliding_window_view(padded, width, axis=0)
    cut: Array = np.minimum(power, _LINE / np.log(2) * np.median(local, axis=-1))
    cut[:4] = power[:4]
    return cut


@dataclass(frozen=True, slots=True)
class MeanError:
    """Error of the mean of a window of c channels.

    Attributes
    ----------
    covariance : (c, c) of the mean, SI squared
    sigma_of_doubled : (c,) standard error that a window twice as long would have
    shape_likelihood : (s, c) log likelihood of the shapes, with earlier windows

    """

    covariance: Array
    sigma_of_doubled: Array
    shape_likelihood: Array


def error_of_mean(
    means: Array, spacing: float, before: Array | None = None
) -> MeanError:
    """Error of the mean of cell means (m, c), m >= 3, no nan.

    `spacing` is the device time from cell to cell, s; `before` the `shape_likelihood`
    (s, c) of earlier windows. Correlations are those of the whitened noise in the band.
    """
    m = len(means)
    f, sums = fourier_sums(means - means.mean(axis=0), spacing)
    shape = SHAPES.spectra(f)
    likelihood, q = log_likelihood(without_lines(np.abs(sums) ** 2), shape)
    likelihood = likelihood if before is None else likelihood + before
    weight = np.exp(_relative_to_largest(likelihood + SHAPES.log_prior[:, None]))
    weight = weight / weight.sum(axis=0)
    level = weight * q / max(1, len(f) - 1)
    once, twice = (
        np.sqrt(level.T @ SHAPES.variance(h * m * spacing) / (h * m)) for h in (1, 2)
    )  # (5)
    white = sums / np.sqrt(shape.T @ weight)
    cross = (white.T @ white.conj()).real
    size = np.sqrt(np.diag(cross))
    scale = once / np.where(size > 0, size, 1.0)
    return MeanError(
        cross * np.outer(scale, scale), twice, _relative_to_largest(likelihood)
    )


def _relative_to_largest(log_likelihood: Array) -> Array:
    relative: Array = log_likelihood - log_likelihood.max(axis=0)
    return relative
