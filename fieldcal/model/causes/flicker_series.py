"""Flicker in the means of a few windows, as a series of principal components.

The rows of a long window are short at its beginning and long at its end, s to minutes.
Cosines at equal steps of frequency do not describe flicker in such rows. The means of
flicker, with the one-sided power density 1 / (2 f), over intervals [a, b] and [c, d]
have the covariance, except for a constant that is part of the bias,

    C = -1/2 [H(b - c) - H(a - c) - H(b - d) + H(a - d)] / ((b - a) (d - c))        (1)

with H(x) = x^2 (ln|x| / 2 - 3 / 4), whose second derivative is ln|x|. The eigenvectors
with the largest eigenvalues are the terms of the series. The remaining part of each row
is nearly white noise. Its size a is estimated from the components of the rows y along
the other eigenvectors Q, which have the variances v; D is the diagonal matrix of the
variances of white noise of the rows:

    Q^T y ~ N(0, a^2 diag(v) + Q^T D Q)                                             (2)

Source: Mandelbrot and Van Ness 1968 for the covariance of increments; Karhunen-Loeve.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model import priors, resolutions, tolerances


@dataclass(frozen=True, slots=True)
class FlickerSeries:
    """Flicker of size one in the means of some rows.

    Attributes
    ----------
    t : (n,) s, the middle of each row, in order
    terms : (n, k) terms of the series, each of rms 1 / sqrt(2)
    sizes : (k,) standard deviation of the coefficient of each term
    others : (n, m) the eigenvectors Q that are not in the series
    variances : (m,) v, variances of their coefficients

    """

    t: Array
    terms: Array
    sizes: Array
    others: Array
    variances: Array

    @classmethod
    def of(cls, t: Array, length: Array) -> FlickerSeries:
        """Series for means about instants t over some lengths, (n,) s each."""
        whole = _covariance(t - length / 2, t + length / 2)
        whole = whole - whole.mean(axis=0)
        whole = whole - whole.mean(axis=1)[:, None]
        variance, along = np.linalg.eigh(whole)
        order = np.argsort(variance)[:0:-1]  # without the smallest: that of the mean
        variance, along = np.maximum(variance[order], 0.0), along[:, order]
        k, even = (
            int(np.clip(len(t) // 2, resolutions.COSINES, resolutions.MAX_COSINES)),
            np.sqrt(len(t) / 2),
        )
        return cls(
            t, along[:, :k] * even, np.sqrt(variance[:k]) / even, along[:, k:],
            variance[k:],
        )  # fmt: skip

    def at(self, t: Array) -> Array:
        """The terms interpolated at other instants (m,), (m, k)."""
        return np.column_stack([np.interp(t, self.t, term) for term in self.terms.T])

    def residual_variance(self, y: Array, sd: Array, typical: Array) -> Array:
        """Variance of each row that the terms do not describe, (n, c).

        Parameters
        ----------
        y, sd : (n, c) means and their white noise; nan where nothing was measured
        typical : (c,) size of flicker

        """
        unit = self.others**2 @ self.variances
        known = np.isfinite(y) & (np.nan_to_num(sd) > 0)
        size = np.zeros(y.shape[1])
        for c in np.flatnonzero(known.any(axis=0) & (len(self.variances) > 0)):
            measured = known[:, c]
            off = np.where(measured, y[:, c] - y[measured, c].mean(), 0.0)
            wide = tolerances.NO_WEIGHT_NOISE * float(sd[measured, c].max())
            size[c] = self._size(off, np.where(measured, sd[:, c], wide), typical[c])
        return np.outer(unit, (size * typical) ** 2)

    def _size(self, y: Array, sd: Array, typical: float) -> float:
        """Most probable size v of flicker besides white noise, by (2).

        `y`, `sd` (n,) are rows and their white noise; `typical` is flicker at v = 1.
        """
        half = np.linalg.cholesky(self.others.T @ (self.others * sd[:, None] ** 2))
        white = np.linalg.solve(half, np.diag(typical * np.sqrt(self.variances)))
        flicker, axes = np.linalg.eigh(white @ white.T)
        power = (axes.T @ np.linalg.solve(half, self.others.T @ y)) ** 2
        sizes = np.append(0.0, priors.SIZES)
        variance = 1 + np.outer(sizes**2, np.maximum(flicker, 0.0))
        score = -0.5 * (power / variance + np.log(variance)).sum(axis=1)
        return float(sizes[np.argmax(score)])


def _covariance(start: Array, end: Array) -> Array:
    """Covariance of the means over intervals, (n, n), by (1)."""
    length = end - start
    integral = (
        _integrated(np.subtract.outer(end, start))
        - _integrated(np.subtract.outer(start, start))
        - _integrated(np.subtract.outer(end, end))
        + _integrated(np.subtract.outer(start, end))
    )
    return -0.5 * integral / np.outer(length, length)  # (1)


def _integrated(x: Array) -> Array:
    """H(x), whose second derivative is ln|x|."""
    size = np.maximum(np.abs(x), 1e-12)
    return x**2 * (np.log(size) / 2 - 0.75)
