"""What noise of a reference hides of the motion that it shows.

A reference shows z = u + e, the motion and white noise of its own. What a device may be
expected to show beside it is less than z, and the less, the weaker the motion is,

    E(u | z) = z - s C^-1 z                                                         (1)

with C the power of a triad of z at a frequency, (3, 3), and s that of e on each axis.
Where that is not known, motion that is no larger than the noise seems to have gone
through a low-pass, and scale factors seem too small. (1) is linear in s, so that a
column for each triad is enough. Units: m/s^2, rad/s; axes of the reference. Source: N.
Wiener 1949; W. Fuller 1987 for the errors of regressors.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.signal import oaconvolve

from fieldcal.core.samples import ACC, GYR, Array
from fieldcal.model import resolutions, tolerances
from fieldcal.model.rows.knots import odd_extension, spline_through
from fieldcal.model.rows.reference import Reference

Powers = NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class ReferenceNoise:
    """White noise of a reference.

    Attributes
    ----------
    hidden : what it hides of the motion, s C^-1 z of (1), by channel
    variance : (2,) s of a sample, by triad: as much as the axis and frequency of least
        power allow
    step : s from sample to sample

    """

    hidden: Reference
    variance: Array
    step: float

    @classmethod
    def of(cls, reference: Reference) -> Self:
        """The noise that a reference may have."""
        z, splines, variance = reference.at(reference.t), [], np.zeros(2)
        length = min(int(resolutions.POWER_PIECE_S / reference.step), len(z))
        for i, triad in enumerate((ACC, GYR)):
            observed = np.flatnonzero(reference.observed[triad]) + triad.start
            if not len(observed):
                continue
            some = z[:, observed] - z[:, observed].mean(axis=0)
            power = _never_singular(_powers(some, length))
            variance[i] = np.linalg.eigvalsh(power).min()
            share = variance[i] * np.linalg.inv(power)
            splines.append(
                (observed, spline_through(reference.t, _filtered(some, share, length)))
            )
        return cls(reference.with_splines(splines), variance, reference.step)


def _powers(z: Array, length: int) -> Powers:
    """Cross powers (f, m, m) of some channels (n, m), 1 for white noise of variance 1.

    They are means over pieces of a length and over near frequencies.
    """
    window = np.hanning(length)
    window /= np.sqrt(window @ window)
    starts = range(0, len(z) - length + 1, max(length // 2, 1))
    pieces = np.array([z[i : i + length] for i in starts]) * window[:, None]
    spectra = np.fft.rfft(pieces, axis=1)
    products = np.einsum("pfi,pfj->fij", spectra, spectra.conj()) / len(starts)
    count = len(products)
    at = np.arange(count)
    share = (resolutions.BAND_RATIO - 1) / 2
    reach = np.maximum(resolutions.POWER_REACH, share * at).astype(int)
    first, end = np.maximum(at - reach, 0), np.minimum(at + reach + 1, count)
    # from the highest frequency, as sums over quick motion are the small ones
    sums = np.cumsum(products[::-1], axis=0)[::-1]
    beyond = np.concatenate([sums, np.zeros_like(sums[:1])])
    powers: Powers = (beyond[first] - beyond[end]) / (end - first)[:, None, None]
    return powers


def _never_singular(power: Powers) -> Powers:
    """Powers with a little on every axis: a motion may be about one axis alone."""
    little = tolerances.AXIS_POWER_SHARE * np.einsum("fii->f", power).real
    little = np.maximum(little, tolerances.MIN_POWER)
    out: Powers = power + little[:, None, None] * np.eye(power.shape[1])
    return out


def _filtered(z: Array, share: Powers, length: int) -> Array:
    """Channels (n, m) after a filter with a response, (f, m, m)."""
    kernel = np.fft.fftshift(np.fft.irfft(share, length, axis=0), axes=0)
    after, before = length // 2, length - 1 - length // 2
    every = odd_extension(z, before, after)
    out = [
        sum(oaconvolve(every[:, j], kernel[:, i, j], "valid") for j in range(len(k)))
        for i, k in enumerate(kernel.transpose(1, 2, 0))
    ]
    return np.stack(out, axis=1)
