"""Variation of the biases within windows, and its part that cosines do not describe.

Biases have a random walk of q per sqrt(s), or flicker: cosines k with variance a^2 / k
over a session of T s, a one-sided power density of a^2 / (2 f) (`wander_sizes`). K
cosines are fitted. Let z = pi l / T, and m_k = sin(k z / 2) / (k z / 2) the mean of
cosine k over l s. The part of a walk that the cosines do not describe has, in means
over l s, the variance

    q^2 T / pi^2 [pi^2 / 6 - pi z / 6 + z^2 / 24 - sum_k m_k^2 / k^2]               (1)

which is nearly white from row to row. For flicker it is

    a^2 / 2 [3 / 2 - ln z + z^2 / 144 - sum_k m_k^2 / k]                            (2)

The covariance of two means tau apart is, with y = pi tau / T,

    q^2 T / pi^2 [pi^2 / 6 - pi y / 2 + y^2 / 4 - sum_k cos(k y) / k^2]             (3)
    + a^2 / 2 [-ln(2 sin(y / 2)) - sum_k cos(k y) / k]                              (4)

with k = 1 ... K. (1) and (2) are the means of (3) and (4) over two intervals of l, (2)
to the fourth power of z. Cosine k exceeds the noise of rows with standard deviations s
up to

    k = q sqrt(2 T J) / pi,    k = a^2 J,    J = sum 1 / (2 s^2)                    (5)

K is twice that: the same number of further cosines is significant only jointly.
Source: Karhunen-Loeve series of Brownian motion; IEEE Std 952 for flicker noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model import priors, resolutions, thresholds, tolerances
from fieldcal.model.causes.flicker_series import FlickerSeries
from fieldcal.model.causes.wander_sizes import wander_sizes
from fieldcal.model.rows.averages import Rows
from fieldcal.model.rows.lean_modes import lean_modes


@dataclass(frozen=True, slots=True)
class Wander:
    """How the biases wander inside windows.

    Attributes
    ----------
    walk_rate : (6,) random walk q of each output, per sqrt(s), given that it has one
    flicker : (6,) flicker a of each output, given that it has flicker
    share : (6,) probability of flicker, given that it has either of the two
    modes : (6,) number of cosines fitted, at least those of a smooth course
    length : s, span of the cosines
    series : series of flicker for few windows; None for more
    unseen : (n, 6) variance of each row that the series does not describe
    leans : (p,) number of cosines of the force's rotation in each position; 0 where the
        angles are set

    """

    walk_rate: Array
    flicker: Array
    share: Array
    modes: Index
    length: float
    series: FlickerSeries | None = None
    unseen: Array | None = None
    leans: Index = field(default_factory=lambda: np.zeros(0, dtype=np.intp))

    @classmethod
    def of(cls, rows: Rows, unit: Array) -> Wander:
        """Estimate it from rows; `unit` (6,) are outputs per SI unit."""
        length = float(np.ptp(rows.x.t))
        speed, flicker, share = wander_sizes(rows, unit)
        information = np.where(rows.used, 1 / rows.sd**2, 0.0).sum(axis=0) / 2
        walks = speed * np.sqrt(2 * length * information) / np.pi  # (5)
        resolved = np.fmax(walks, flicker**2 * information)  # (5)
        modes = np.clip(
            resolutions.COSINES_PER_VISIBLE * resolved,
            resolutions.COSINES,
            resolutions.MAX_COSINES,
        ).astype(np.intp)
        leans = lean_modes(rows)
        out = cls(speed, flicker, share, modes, length, leans=leans)
        if not len(np.unique(rows.x.position)) < thresholds.MIN_ALIKE < len(rows.x):
            return out
        series = FlickerSeries.of(rows.x.t, rows.length)
        unseen = series.residual_variance(rows.y, rows.sd, priors.INSTABILITY * unit)
        return replace(out, series=series, unseen=unseen)

    @classmethod
    def none(cls) -> Wander:
        """No random walk and no flicker."""
        nothing = np.zeros(6)
        return cls(nothing, nothing, nothing, np.full(6, resolutions.COSINES), 0.0)

    def residual_variance_of_rows(self, length: Array, channel: int) -> Array:
        """Variance of all rows that neither cosines nor series describe, (n,)."""
        out = self.residual_variance(length, channel)
        return out if self.unseen is None else out + self.unseen[:, channel]

    def residual_variance(self, length: Array, channel: int) -> Array:
        """Variance of means over some lengths beyond its cosines, (n,)."""
        q, a, count = self._of_channel(channel)
        if not (q or a):
            return np.zeros(len(length))
        # rows have few different lengths, except for rounding errors of their times
        few, at = np.unique(length.round(6), return_inverse=True)
        walks = q**2 * _residual_of_walk(self.length, few, count)
        return (walks + a**2 * _residual_of_flicker(self.length, few, count))[at]

    def residual_covariance(
        self, t: Array, length: Array, channels: Sequence[int] = range(6)
    ) -> Array:
        """Covariance of means about some instants beyond the cosines, (c, n, n).

        Of each of c channels; the means are over `length` (n,) s about `t` (n,) s.
        """
        y = np.pi * np.abs(np.subtract.outer(t, t)) / max(self.length, 1e-9)
        k = np.arange(1, self.modes[[*channels]].max() + 1)
        waves = np.cos(np.multiply.outer(y, k))
        out, diagonal = np.zeros((len(channels), *y.shape)), np.s_[:: len(t) + 1]
        for own, c in zip(out, channels, strict=True):
            q, a, count = self._of_channel(c)
            variance = self.residual_variance(length, c)
            if not variance.any():
                continue
            fitted, k = waves[..., :count], np.arange(1, count + 1)
            left = np.pi**2 / 6 - np.pi * y / 2 + y**2 / 4 - fitted @ (1 / k**2)
            own[:] = q**2 * self.length / np.pi**2 * left  # (3)
            if a:
                all_cosines = -np.log(
                    2 * np.sin(np.clip(y, tolerances.ROUNDING, np.pi) / 2)
                )
                own += a**2 / 2 * (all_cosines - fitted @ (1 / k))  # (4)
            own.flat[diagonal] = variance
        return out

    def _of_channel(self, channel: int) -> tuple[float, float, int]:
        """Walk q and flicker a of a channel, weighted by `share`, and its cosines."""
        share = float(self.share[channel])
        q = float(self.walk_rate[channel]) * (1 - share) ** 0.5
        return q, float(self.flicker[channel]) * share**0.5, int(self.modes[channel])


def _residual_of_walk(whole: float, length: Array, count: int) -> Array:
    """Variance (1) of means over `length` (n,) s of a walk of 1 per sqrt(s), (n,).

    `whole` is T, s, and `count` K.
    """
    z, k = np.pi * length / whole, np.arange(1, count + 1)
    total = np.pi**2 / 6 - np.pi * z / 6 + z**2 / 24
    left: Array = np.maximum(total - _means(z, k) ** 2 @ k**-2.0, 0.0)  # (1)
    return whole / np.pi**2 * left


def _residual_of_flicker(whole: float, length: Array, count: int) -> Array:
    """Variance (2) of means over `length` (n,) s of flicker with a = 1, (n,)."""
    z, k = (
        np.maximum(np.pi * length / whole, tolerances.ROUNDING),
        np.arange(1, count + 1),
    )
    taken = _means(z, k) ** 2 @ (1 / k)
    out: Array = np.maximum(1.5 - np.log(z) + z**2 / 144 - taken, 0.0) / 2  # (2)
    return out


def _means(z: Array, k: Index) -> Array:
    """Means m_k of cosines over intervals, (n, k)."""
    return np.sinc(np.multiply.outer(z, k) / (2 * np.pi))
