"""Random errors of the six channels, the same however they are drawn in pieces.

    white        x_k = s z_k,  s = density sqrt(rate)               (n1)
    Gauss-Markov x_k = c x_(k-1) + s sqrt(1 - c^2) z_k,  c = exp(-1 / (rate tau))  (n2)
    random walk  x_k = x_(k-1) + s z_k / sqrt(rate)                 (n3)
    1/f          a sum of (n2) with tau = 1, 4, 16 … s, whose Allan deviation is
                 level between the shortest and the longest          (n4)

z_k are standard normal, one sequence for each kind of error, so that switching one on
does not change another. (n4) is scaled by the Allan variance of one of its terms,

    a(T) = 2 s^2 (r - r^2 (3 - 4 e^(-1/r) + e^(-2/r)) / 2),  r = tau / T  (n5)

Outputs (6, n) in m/s^2 and rad/s. Source: IEEE Std 952-1997, annex C.
"""

from __future__ import annotations

from zlib import crc32

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.profile import NoiseFigures, Triad

FLICKER_TAU = 4.0 ** np.arange(8)
"""Correlation times of the terms of 1/f noise, s."""

BLOCK = 64
"""Ticks of the sampling clock that a Gauss-Markov process is calculated in."""


def stream(seed: int, name: str) -> np.random.Generator:
    """Random numbers for one purpose, apart from those of every other."""
    return np.random.default_rng([seed, crc32(name.encode())])


class Walk:
    """Random walk (n3) of six channels; `size` (6,) per sqrt(s)."""

    def __init__(self, size: Array, rate: float, rng: np.random.Generator) -> None:
        self._step = size / np.sqrt(rate)
        self._rng = rng
        self._last: Array = np.zeros((1, 6))

    def draw(self, n: int) -> Array:
        """Next `n` values, (6, n)."""
        steps = self._step * self._rng.standard_normal((n, 6))
        path: Array = np.cumsum(np.concatenate([self._last, steps]), axis=0)  # (n3)
        self._last = path[-1:]
        walked: Array = path[1:].T
        return walked


class GaussMarkov:
    """Bias (n2) that wanders within its standard deviation `size` (6,).

    The recursion runs in blocks of `BLOCK` ticks counted from the start, side by side,

        x_(b, j) = y_(b, j) + c^(j+1) x_(b-1, last),  y_(b, j) = c y_(b, j-1) + drive

    so that the values do not depend on the pieces they are drawn in.
    """

    def __init__(
        self, size: Array, tau: float, rate: float, rng: np.random.Generator
    ) -> None:
        self._keep = float(np.exp(-1 / (rate * tau)))
        self._step = size * np.sqrt(1 - self._keep**2)
        self._rng = rng
        self._last: Array = size * rng.standard_normal(6)
        self._ready: Array = np.empty((0, 6))

    def draw(self, n: int) -> Array:
        """Next `n` values, (6, n)."""
        lacking = n - len(self._ready)
        if lacking > 0:
            more = self._more(-(-lacking // BLOCK))
            self._ready = np.concatenate([self._ready, more])
        values, self._ready = self._ready[:n], self._ready[n:]
        return values.T

    def _more(self, blocks: int) -> Array:
        """Whole blocks, (blocks * BLOCK, 6)."""
        x: Array = self._step * self._rng.standard_normal((blocks, BLOCK, 6))
        for j in range(1, BLOCK):
            x[:, j] += self._keep * x[:, j - 1]  # (n2)
        fading = self._keep ** np.arange(1, BLOCK + 1)[:, None]
        for block in x:
            block += fading * self._last
            self._last = block[-1].copy()
        return x.reshape(-1, 6)


class RandomErrors:
    """All random errors of a device."""

    def __init__(
        self, figures: NoiseFigures, rate: float, seed: int, ratio: Array
    ) -> None:
        self._white = ratio * white_sigma(figures, rate)
        self._rng = stream(seed, "white")
        self._slow: list[Walk | GaussMarkov] = []
        walk = _six(figures.acc_walk, figures.gyr_walk)
        if walk.any():
            self._slow.append(Walk(walk, rate, stream(seed, "walk")))
        wander = _six(figures.acc_instability, figures.gyr_instability)
        if wander.any():
            rng = stream(seed, "instability")
            tau = figures.instability_s
            self._slow.append(GaussMarkov(wander, tau, rate, rng))
        flicker = _six(figures.acc_flicker, figures.gyr_flicker) * _flicker_scale()
        if flicker.any():
            rngs = stream(seed, "flicker").spawn(len(FLICKER_TAU))
            self._slow += [
                GaussMarkov(flicker, float(tau), rate, rng)
                for tau, rng in zip(FLICKER_TAU, rngs, strict=True)
            ]

    def white(self, n: int) -> Array:
        """White noise (n1) of the next `n` samples, (6, n)."""
        return (self._white * self._rng.standard_normal((n, 6))).T

    def slow(self, n: int) -> Array:
        """What wanders, over the next `n` ticks of the sampling clock, (6, n)."""
        total = np.zeros((6, n))
        for process in self._slow:
            total += process.draw(n)
        return total


def white_sigma(figures: NoiseFigures, rate: float) -> Array:
    """Standard deviation of a sample's white noise, (6,), (n1)."""
    both = []
    for sigma, density in (
        (figures.acc, figures.acc_density),
        (figures.gyr, figures.gyr_density),
    ):
        both += list(sigma if density is None else np.sqrt(rate) * np.array(density))
    return np.array(both)


def _six(acc: Triad, gyr: Triad) -> Array:
    return np.array([*acc, *gyr])


def _flicker_scale() -> float:
    """Standard deviation of a term of (n4) for an Allan deviation of 1, by (n5)."""
    middle = np.sqrt(FLICKER_TAU[0] * FLICKER_TAU[-1])
    r = FLICKER_TAU / middle
    e = np.exp(-1 / r)
    return float(1 / np.sqrt(np.sum(2 * (r - r * r * (3 - 4 * e + e * e) / 2))))
