"""Gyroscopes without bias, since the device has subtracted it at rest.

Means of n windows of an output with an offset of exactly zero, each with the error that
white noise gives it, have

    chi2 = sum over windows of (mean / sigma)^2,   P(chi2 or less; n)              (1)

and gyroscopes whose biases return within s_b from run to run, and feel the Earth, come
so close to zero, with an error s of each axis over all windows, with a chance of

    P = product over axes of min(1, 4 s / (sqrt(2 pi) sqrt(s_b^2 + w_E^2 / 3)))    (2)

If a device removes the bias of its gyroscopes at rest, chi2 (1) is not significant.
What a turn put out is removed again in some seconds, so the means are c of

    W(t) = c + d exp(-t / tau)                                                     (3)

in each window, with the tau that all windows have the least residual with. The removal
also takes out slow noise, so sigma is that of the noise at quick frequencies: the
median of the periodogram over ln 2, or that of a lower octave with more than a filter
left of it. A device that takes the mean of its first T seconds at rest for its bias
until the next turn leaves the noise of that mean in all of a window, and before what it
took out the last time. The means are c of

    W(t) = c + d (t < T'),   sigma^2 = sigma_c^2 + noise^2 / (T rate)              (4)

with the T' that has the least residual, and any T. Either is so many times as likely as
gyroscopes that keep a bias, that of the spread s_b, and feel by how they lie, e:

    B = prod N(c; 0, sigma^2) / prod N(c; 0, sigma_c^2 + e^2 + s_b^2 everywhere)   (5)

over windows and axes. Gyroscopes whose bias is known have the Earth's rate w alone, in
an unknown direction, and (5) with m = |c| in place of the second

    p(c) = N(c; 0, sigma_c^2) exp(-w^2 / 2 sigma_c^2) sinh(x) / x,  x = m w / sigma_c^2
                                                                                   (6)
An autopilot that tells the offset it subtracts has, as likely as not, averaged it when
it started, over any T: a bias of s_b^2 = noise^2 / (T rate) is left while it runs.
Of gyroscopes with a bias one in x has a B above x at most, and of all devices TRACKING
remove it. Device axes, rad/s. Source: Markov's inequality for a likelihood ratio.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.chances import chi2_tail, of_odds
from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import Array, Block
from fieldcal.windows import Average

LEAST = 2
"""Fewest windows for (1)."""

TRACKING = 0.01
"""Share of devices that subtract their bias at rest, as is common in low-cost ones."""

DOUBT = 0.1
"""Probability of such a device with which there is no GO any more."""

LEANING = (0.0, 0.01, 0.03, 0.1)
"""How much gyroscopes feel by how they lie, by their g-sensitivity above all, in the
spread of their biases, one as likely as another; the Earth's rate comes on top of it,
but for the first, as in a simulation."""

LAGS = np.geomspace(0.25, 16.0, 49)
"""Time constants of (3), and times of (4), that are tried, s."""

CELLS = 256
"""Most means of a window in which (3) and (4) are fitted."""

SPECTRUM, OCTAVES, FILTERS = 16, 4, 4.0
"""Fewest samples for a periodogram, and powers for one of its upper octaves; and by
how many standard deviations one has more that lies below a filter."""


@dataclass(frozen=True, slots=True)
class BiasSpread:
    """What the biases of gyroscopes that keep them may be.

    Attributes
    ----------
    repeat : spread from run to run, 1 sigma, rad/s
    averaged : whether the device tells of an offset that it subtracts all the time

    """

    repeat: float
    averaged: bool = False


def tracked(
    windows: Sequence[Average], block: Block, keeps: BiasSpread, least: float
) -> tuple[float, str]:
    """Probability of a device that subtracts its bias at rest, (5), and chi2 in words.

    0 if the means are significantly different from zero, or too few were measured.
    """
    held = [block.between(w.start, w.end) for w in windows]
    cells = [_Cells.of(one) for one in held if len(one) >= SPECTRUM]
    if not cells:
        return 0.0, ""
    second = np.median([one.noise_of_a_second for one in cells], axis=0)
    left = [second / np.sqrt(s) for s in LAGS] if keeps.averaged else []
    biases = [np.full(3, keeps.repeat), *left]
    stays = _Stays(keeps.repeat, biases)
    settled, own = _settled_means(cells)
    found = [_so_near_zero(settled, own, [own], stays, least)]
    found += [
        _so_near_zero(means, own, every, stays, least)
        for means, own, every in _zeroed_means(cells)
    ]
    return max(found)


def _so_near_zero(
    means: Array, own: Array, every: Sequence[Array], keeps: _Stays, least: float
) -> tuple[float, str]:
    """Probability (5) of means about zero, with an error that is one of `every`."""
    seen = np.isfinite(means) & (own > 0)
    if (count := int(seen.sum())) < 3 * LEAST or not seen.any(axis=0).all():
        return 0.0, ""
    sigma = min(every, key=lambda one: _unlikely(means[seen], one[seen]))
    chi2, larger = chi2_about_zero(means[seen], sigma[seen])
    if larger < least:
        return 0.0, ""
    zero = _mean([-0.5 * _unlikely(means[seen], one[seen]) for one in every])
    stays = keeps.likelihood(means, own, seen)
    odds = zero - stays + np.log(TRACKING)  # (5)
    chance = float(of_odds(odds))
    return chance, f"(χ² about zero {chi2:.2g} of {count} means)"


def _unlikely(means: Array, sigma: Array) -> float:
    """Minus twice the log likelihood of means about zero, but for a constant."""
    return float(np.sum((means / sigma) ** 2 + 2 * np.log(sigma)))


def _earth_alone(means: Array, own: Array) -> float:
    """Log likelihood of the Earth's rate in unknown directions, but for a constant."""
    var = own**2
    one = var.mean(axis=1)
    x = np.maximum(np.linalg.norm(means, axis=1) * EARTH_RATE / one, 1e-9)
    sphere = np.log(-np.expm1(-2 * x) / (2 * x)) + x - EARTH_RATE**2 / (2 * one)  # (6)
    return -0.5 * _unlikely(means, own) + float(np.sum(sphere))


def chi2_about_zero(means: Array, sigma: Array) -> tuple[float, float]:
    """Chi-squared of means, and the probability of a larger one, (1)."""
    chi2 = float(np.sum((means / sigma) ** 2))
    return chi2, chi2_tail(chi2, len(means))


def chance_near_zero(sigma: Array, spread: float | Array) -> float:
    """Probability that offsets of a spread come so close to zero on all axes, (2)."""
    return float(np.minimum(4 * sigma / np.sqrt(2 * np.pi) / spread, 1.0).prod())


def _settled_means(cells: Sequence[_Cells]) -> tuple[Array, Array]:
    """What gyroscopes settle to in windows, c of (3), and its error, (w, 3) each."""
    return _fitted(cells, LAGS, lambda t, lag: np.exp(-t / lag))


def _zeroed_means(
    cells: Sequence[_Cells],
) -> Iterator[tuple[Array, Array, Sequence[Array]]]:
    """Means c of (4), their own error, and that with the noise of any T."""
    first, last = max(c.t[0] for c in cells), min(c.t[-1] for c in cells) / 2
    times = LAGS[(first < LAGS) & (last > LAGS)]
    if not len(times):
        return
    means, own = _fitted(cells, times, lambda t, end: 1.0 * (t < end))
    of_second = np.array([one.noise_of_a_second for one in cells])
    yield means, own, [np.hypot(own, of_second / np.sqrt(s)) for s in LAGS]


def _fitted(
    cells: Sequence[_Cells], times: Array, shape: Callable[[Array, float], Array]
) -> tuple[Array, Array]:
    """Constants c beside a shape with the time that leaves least, and their errors."""
    every = [[one.beside(shape(one.t, time)) for one in cells] for time in times]
    left = [np.nansum([chi2 for _, _, chi2 in found]) for found in every]
    best = every[int(np.argmin(left))]
    return np.array([c for c, _, _ in best]), np.array([s for _, s, _ in best])


@dataclass(frozen=True, slots=True)
class _Stays:
    """Gyroscopes that keep a bias, the second of (5).

    Attributes
    ----------
    repeat : spread of biases from run to run, 1 sigma, rad/s
    biases : (3,) each, of what may be left in this run: the first as likely as all
        others together

    """

    repeat: float
    biases: Sequence[Array]

    def likelihood(self, means: Array, own: Array, seen: NDArray[np.bool_]) -> float:
        """Log likelihood of means (w, 3), but for a constant."""
        first, *others = (self._of(b, means, own, seen) for b in self.biases)
        if not others:
            return first
        return float(np.logaddexp(first, _mean(others)) - np.log(2.0))

    def _of(
        self, bias: Array, means: Array, own: Array, seen: NDArray[np.bool_]
    ) -> float:
        ways = [self._leaning(bias, means, own, seen, part) for part in LEANING]
        return _mean([*ways, *([_earth_alone(means, own)] if seen.all() else [])])

    def _leaning(
        self,
        bias: Array,
        means: Array,
        own: Array,
        seen: NDArray[np.bool_],
        leaning: float,
    ) -> float:
        felt = (leaning * self.repeat) ** 2 + (EARTH_RATE**2 / 3 if leaning else 0.0)
        info = np.where(seen, 1 / np.where(seen, own**2 + felt, 1.0), 0.0)
        value, var = np.where(seen, means, 0.0), bias**2
        total, pull = info.sum(axis=0), (info * value).sum(axis=0)
        square = (info * value**2).sum(axis=0) - var * pull**2 / (1 + var * total)
        wide = np.log1p(var * total).sum() - np.log(info[seen]).sum()
        return -0.5 * float(square.sum() + wide)


def _mean(logs: Sequence[float]) -> float:
    """Log of the mean of exponentials."""
    return float(np.logaddexp.reduce(logs) - np.log(len(logs)))


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

    @property
    def noise_of_a_second(self) -> Array:
        """What white noise leaves in the mean of a second, rad/s, (3,)."""
        second: Array = self.noise * np.sqrt(self.t[1] - self.t[0])
        return second

    def beside(self, shape: Array) -> tuple[Array, Array, Array]:
        """Get c beside a shape, its error, and chi2 of the rest (0 without noise)."""
        design = np.column_stack([np.ones(len(self.t)), shape])
        inner = np.linalg.inv(design.T @ design)
        fit = inner @ (design.T @ self.gyr)
        left = ((self.gyr - design @ fit) ** 2).sum(axis=0)
        some = self.noise > 0
        chi2 = np.divide(left, self.noise**2, out=np.zeros(3), where=some)
        return fit[0], self.noise * np.sqrt(inner[0, 0]), chi2


def _white_noise(gyr: Array) -> Array:
    """Noise of a sample at all frequencies, (3,); before a filter, if one took some.

    A filter, or a program that draws lines between samples, leaves less in the upper
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
