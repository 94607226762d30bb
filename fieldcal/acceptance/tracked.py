"""Gyroscopes without bias, since the device has subtracted it at rest.

Means of n windows of an output with an offset of exactly zero, each with the error that
white noise gives it, have

    chi2 = sum over windows of (mean / sigma)^2,   P(chi2 or less; n)              (1)

and gyroscopes whose biases return within s_b from run to run, and feel the Earth, come
so close to zero, with an error s of each axis over all windows, with a chance of

    P = product over axes of min(1, 4 s / (sqrt(2 pi) sqrt(s_b^2 + w_E^2 / 3)))    (2)

If a device removes the bias of its gyroscopes at rest, chi2 (1) is not significant, and
the product of (1) and (2) is the probability that this is chance. What a turn put out
is removed again in some seconds, so the means are c of

    W(t) = c + d exp(-t / tau)                                                     (3)

in each window, with the tau that all windows have the least residual with. The removal
also takes out slow noise, so sigma is that of the noise at all frequencies: the median
of the periodogram over ln 2. A device that takes the mean of its first T seconds at
rest for its bias until the next turn leaves the noise of that mean in all of a window,
and before what it took out the last time. The means are c of

    W(t) = c + d (t < T'),   sigma^2 = sigma_c^2 + noise^2 / (T rate)              (4)

with the T' that has the least residual, and the T that the means are likeliest with.
This counts if it is likelier than a bias b that stays, the mean of c, and 1 / P times
as likely, with the P that excludes chance, as one beside the Earth's rate w in an
unknown direction. m = |c - b| then has the density

    p(m) ~ sigma_c^-3 exp(-(m^2 + w^2) / 2 sigma_c^2) sinh(x) / x,  x = m w / sigma_c^2
                                                                                   (5)
Device axes, rad/s.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.core.chances import chi2_tail
from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import Array, Block
from fieldcal.windows import Average

LEAST = 2
"""Fewest windows for (1)."""

TRACKING, SURE = 0.01, 0.9
"""Share of devices that subtract their bias at rest, as is common in low-cost ones, and
the probability from which one is taken to do so."""

LAGS = np.geomspace(0.25, 16.0, 49)
"""Time constants of (3), and times of (4), that are tried, s."""

CELLS = 256
"""Most means of a window in which (3) and (4) are fitted."""

SPECTRUM = 16
"""Fewest samples for a periodogram."""


def tracks(chance: float) -> bool:
    """Whether a device subtracts its bias, by the chance that another looks like it.

    >>> tracks(1e-3), tracks(2e-3)
    (True, False)
    """
    return TRACKING / (TRACKING + chance) > SURE


def tracked(
    windows: Sequence[Average], block: Block, repeat: float, least: float
) -> tuple[float, str]:
    """Probability of gyroscopes' means so close to zero, (1) (2), and chi2 in words.

    1 if they are significantly different from zero, or too few were measured.
    """
    held = [block.between(w.start, w.end) for w in windows]
    cells = [_Cells.of(one) for one in held if len(one) >= SPECTRUM]
    if not cells:
        return 1.0, ""
    ways = [_settled_means(cells), *_zeroed_means(cells, least)]
    return min(_so_near_zero(*way, repeat, least) for way in ways)


def _so_near_zero(
    means: Array, sigma: Array, repeat: float, least: float
) -> tuple[float, str]:
    """Probability of means so close to zero, (1) (2), and their chi2 in words."""
    seen = np.isfinite(means) & (sigma > 0)
    if (count := int(seen.sum())) < 3 * LEAST or not seen.any(axis=0).all():
        return 1.0, ""
    chi2, larger = chi2_about_zero(means[seen], sigma[seen])
    if larger < least:
        return 1.0, ""
    info = np.where(seen, 1.0 / np.where(seen, sigma, 1.0) ** 2, 0.0).sum(axis=0)
    felt = float(np.hypot(repeat, EARTH_RATE / np.sqrt(3.0)))
    chance = (1.0 - larger) * chance_near_zero(1 / np.sqrt(info), felt)
    return chance, f"(χ² about zero {chi2:.2g} of {count} means)"


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
    cells: Sequence[_Cells], least: float
) -> Iterator[tuple[Array, Array]]:
    """Means c of (4), and their error, if a mean was taken out."""
    first, last = max(c.t[0] for c in cells), min(c.t[-1] for c in cells) / 2
    times = LAGS[(first < LAGS) & (last > LAGS)]
    if not len(times):
        return
    means, own = _fitted(cells, times, lambda t, end: 1.0 * (t < end))
    of_second = np.array([one.noise * np.sqrt(one.t[1] - one.t[0]) for one in cells])
    every = [np.hypot(own, of_second / np.sqrt(seconds)) for seconds in LAGS]
    sigma = min(every, key=lambda one: _unlikely(means, one))
    bias = means.mean(axis=0)
    earth = min(_unlikely(means - b, own, EARTH_RATE) for b in (0.0, bias))
    stays = min(earth + 2 * np.log(least), _unlikely(means - bias, own))
    if _unlikely(means, sigma) < stays:
        yield means, sigma


def _unlikely(means: Array, sigma: Array, rate: float = 0.0) -> float:
    """Minus twice the log likelihood of means about zero, or about a sphere, (5)."""
    some = (sigma > 0).all(axis=1) & np.isfinite(means).all(axis=1)
    var = sigma[some] ** 2
    out = float(np.sum((means[some] ** 2) / var + np.log(var)))
    if rate:
        one = var.mean(axis=1)
        x = np.linalg.norm(means[some], axis=1) * rate / one
        out += float(np.sum(rate**2 / one - 2 * _log_sinhc(x)))
    return out


def _log_sinhc(x: Array) -> Array:
    """Get ln(sinh(x) / x)."""
    x = np.maximum(x, 1e-9)
    out: Array = x + np.log(-np.expm1(-2 * x) / (2 * x))
    return out


def _fitted(
    cells: Sequence[_Cells], times: Array, shape: Callable[[Array, float], Array]
) -> tuple[Array, Array]:
    """Constants c beside a shape with the time that leaves least, and their errors."""
    every = [[one.beside(shape(one.t, time)) for one in cells] for time in times]
    left = [np.nansum([chi2 for _, _, chi2 in found]) for found in every]
    best = every[int(np.argmin(left))]
    return np.array([c for c, _, _ in best]), np.array([s for _, s, _ in best])


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
    """Noise of a sample at all frequencies, (3,)."""
    power = np.abs(np.fft.rfft(gyr - gyr.mean(axis=0), axis=0)[1:-1]) ** 2
    level: Array = np.sqrt(np.median(power, axis=0) / len(gyr) / np.log(2.0))
    return level
