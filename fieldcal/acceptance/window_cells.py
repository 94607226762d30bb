"""Gyroscopes at rest in a window, as means over equal numbers of samples.

Their noise is that of the samples at high frequencies, which a removal of the bias
leaves as it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array, Block, Index

CELLS = 256
"""Largest number of means in a window."""

SPECTRUM, OCTAVES, FILTERS = 16, 4, 4.0
"""Fewest samples of a periodogram and powers of an octave; number of octaves; standard
deviations by which an octave below the band of a filter has more power."""


@dataclass(frozen=True, slots=True)
class WindowCells:
    """Gyroscopes at rest in a window, as means over equal numbers of samples.

    Attributes
    ----------
    t : (k,) s since the window began
    gyr : (k, a) rad/s, of some axes
    noise : (a,) rad/s, white noise of each mean

    """

    t: Array
    gyr: Array
    noise: Array

    @classmethod
    def of(cls, one: Block, axes: Index) -> WindowCells:
        """The means of a window, at most `CELLS`, of some axes.

        The mean of an exponential over a cell is its value in the middle, times the
        same factor for all cells.
        """
        each = -(-len(one) // CELLS)
        count = len(one) // each
        t, gyr = one.t[: count * each] - one.t[0], one.gyr[: count * each, axes]
        level = white_noise(one.gyr[:, axes]) / np.sqrt(each)
        means = gyr.reshape(count, each, len(axes)).mean(axis=1)
        return cls(t.reshape(count, each).mean(axis=1), means, level)

    @property
    def noise_of_a_second(self) -> Array:
        """White noise of a mean over one second, rad/s, (3,)."""
        second: Array = self.noise * np.sqrt(self.t[1] - self.t[0])
        return second

    def fit_constants(self, shapes: Array) -> tuple[Array, Array, Array]:
        """Fit c and each of some shapes (s, k).

        c, its error, and chi2 of the rest, (s, a) each; chi2 is 0 without noise.
        """
        middle = self.gyr.mean(axis=0)
        off, total = self.gyr - middle, shapes.sum(axis=1)[:, None]
        square = (shapes**2).sum(axis=1)[:, None]
        by_shape, det = shapes @ off, len(self.t) * square - total**2
        left = (off**2).sum(axis=0) - len(self.t) * by_shape**2 / det
        some = self.noise > 0
        chi2 = np.divide(left, self.noise**2, out=np.zeros(left.shape), where=some)
        return middle - total * by_shape / det, self.noise * np.sqrt(square / det), chi2


def white_noise(gyr: Array) -> Array:
    """White noise of a sample, (3,); before a filter, if there is one.

    A filter, or a program that interpolates samples, leaves less power in the upper
    octaves than in those below. The median of m powers scatters by its 1.44 m^-1/2.
    """
    power = np.abs(np.fft.rfft(gyr - gyr.mean(axis=0), axis=0)[1:-1]) ** 2
    level: Array = np.median(power, axis=0)
    for k in range(1, OCTAVES):
        octave = power[len(power) >> (k + 1) : len(power) >> k]
        if len(octave) < SPECTRUM:
            break
        own, scatters = np.median(octave, axis=0), 1.44 / np.sqrt(len(octave))
        level = np.where(own > (1 + FILTERS * scatters) * level, own, level)
    return np.asarray(np.sqrt(level / len(gyr) / np.log(2.0)))
