"""How fast the biases wander inside windows, before anything is fitted.

A walk of q per sqrt(s) makes the means d of two neighbouring rows of length l differ by

    var(d' - d) = s'^2 + s^2 + q^2 (l' + l) / 3                                     (1)

beside their white noise s. The median of (d' - d)^2 over (1) tells q, in the later half
of each window, when what settles after a turn has; ln r, r being that median over the
one of chi squared, scatters by 2.3 / sqrt(n) with n differences. Of K cosines over T s
a walk leaves rows

    q^2 [T / (pi^2 K) - l / 6]                                                     (2)

of variance, which is as good as white from row to row; two means tau apart share

    q^2 T / pi^2 [pi^2 / 6 - pi x / 2 + x^2 / 4 - sum_k cos(k x) / k^2]            (3)

with x = pi tau / T and k = 1 ... K. Cosine k of it, of standard deviation q sqrt(2 T) /
(pi k), is beyond the noise of n rows up to

    K = q sqrt(2 T) / pi sqrt(sum 1 / (2 s^2))                                      (4)

Source: Karhunen-Loeve series of Brownian motion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import CHANNELS, Array, Index
from fieldcal.effects import catalogue
from fieldcal.model import priors
from fieldcal.model.causes import smooth
from fieldcal.model.rows.reduce import Rows
from fieldcal.physics.effect import Scatter

CHI2_MEDIAN, SCATTERS = 0.4549, 2.3
"""Of chi squared with one degree of freedom: median; scatter of the median's ln."""

SIZES: Array = np.geomspace(priors.SIZES[0], priors.SIZES[-1], 8 * 32 + 1)
"""Values of v, closer together than those of groups: this one is taken as it is."""

DENSITY: Array = np.interp(np.log(SIZES), np.log(priors.SIZES), priors.density()) / 8
"""Probability of each."""

FEWEST = 8
"""Differences below which they tell nothing."""

TINY = 1e-12
"""Of ratios, where a channel repeats one value."""


@dataclass(frozen=True, slots=True)
class Wander:
    """How the biases wander inside windows.

    Attributes
    ----------
    speed : (6,) of each output, per sqrt(s)
    modes : (6,) cosines of it that rows see, at least those of a smooth course
    length : s that these are drawn over

    """

    speed: Array
    modes: Index
    length: float

    @classmethod
    def of(cls, rows: Rows, unit: Array) -> Wander:
        """Measure it in rows; `unit` (6,) are outputs per SI unit."""
        length, speed = float(np.ptp(rows.x.t)), _speed(rows, unit)
        information = np.where(rows.used, 1 / rows.sd**2, 0.0).sum(axis=0) / 2
        resolved = speed * np.sqrt(2 * length * information) / np.pi  # (4)
        modes = np.clip(resolved, smooth.WAVES, priors.MOST_WAVES).astype(np.intp)
        return cls(speed, modes, length)

    @classmethod
    def none(cls) -> Wander:
        """Of rows that are as white as their samples."""
        return cls(np.zeros(6), np.full(6, smooth.WAVES), 0.0)

    def left(self, length: Array, channel: int) -> Array:
        """Variance that its cosines leave of means over some lengths, (n,)."""
        part = _left(self.length, length, int(self.modes[channel]))
        out: Array = self.speed[channel] ** 2 * part
        return out

    def apart(self, t: Array, length: Array) -> Array:
        """Covariance that they leave of means about some instants, (6, n, n)."""
        x = np.pi * np.abs(np.subtract.outer(t, t)) / max(self.length, 1e-9)
        shares = {}
        for count in np.unique(self.modes).tolist():
            k = np.arange(1, count + 1)
            taken = np.cos(np.multiply.outer(x, k)) @ (1 / k**2)
            left = np.pi**2 / 6 - np.pi * x / 2 + x**2 / 4 - taken
            shares[count] = self.length / np.pi**2 * left  # (3)
            shares[count].flat[:: len(t) + 1] = _left(self.length, length, count)
        every = np.stack([shares[count] for count in self.modes.tolist()])
        out: Array = self.speed[:, None, None] ** 2 * every
        return out


def _left(whole: float, length: Array, count: int) -> Array:
    """Variance that cosines leave of means of a walk of 1 per sqrt(s), (n,)."""
    left: Array = np.maximum(whole / (np.pi**2 * count) - length / 6, 0.0)  # (2)
    return left


def _speed(rows: Rows, unit: Array) -> Array:
    """How far each output wanders beyond its noise, per sqrt(s), (6,).

    The mean over all sizes and none, by their probabilities: nothing, where rows show
    none.
    """
    out = np.zeros(6)
    for effect in catalogue().values():
        if isinstance(effect, Scatter) and len(effect.params) == len(CHANNELS):
            for c, param in enumerate(effect.params):
                sizes = np.append(0.0, SIZES * param.typical * unit[c])
                weight = _weights(rows, c, sizes, effect.chance(rows.x))
                out[c] = np.hypot(out[c], np.sqrt(weight @ sizes**2))
    return out


def _weights(rows: Rows, c: int, sizes: Array, chance: float) -> Array:
    """Probabilities of sizes on one channel, the first of which is none."""
    at = _later(rows)
    at = at[rows.used[at, c] & rows.used[at + 1, c]]
    before = np.append(1 - chance, chance * DENSITY)
    if len(at) < FEWEST:
        return np.where(sizes > 0, 0.0, 1.0)
    step = rows.y[at + 1, c] - rows.y[at, c]
    for p in np.unique(rows.x.position[at]):  # what goes evenly does not wander
        step[rows.x.position[at] == p] -= np.median(step[rows.x.position[at] == p])
    white = rows.sd[at, c] ** 2 + rows.sd[at + 1, c] ** 2
    length = (rows.length[at] + rows.length[at + 1]) / 3
    known = step**2 / (white + np.multiply.outer(sizes**2, length))  # (1)
    ratio = np.maximum(np.median(known, axis=1) / CHI2_MEDIAN, TINY)
    score = np.log(before) - len(step) / 2 * (np.log(ratio) / SCATTERS) ** 2
    weight: Array = np.exp(score - np.logaddexp.reduce(score))
    return weight


def _later(rows: Rows) -> Index:
    """Rows of the later half of each window that have a next one."""
    position = rows.x.position
    near = np.flatnonzero(np.diff(position) == 0)
    first = np.searchsorted(position, position[near])
    count = np.searchsorted(position, position[near], side="right") - first
    out: Index = near[2 * (near - first) >= count - 1]
    return out
