"""Random errors of the six channels, the same however they are drawn in pieces.

    white        x_k = s z_k,  s = density sqrt(rate)               (n1)
    wandering    Gauss-Markov and random walk (p1) (p2) of `random_process`
    1/f          a sum of (p1) with tau = 1, 4, 16 … s, whose Allan deviation is
                 level between the shortest and the longest          (n2)

z_k are standard normal, one sequence for each kind of error, so that switching one on
does not change another. (n2) is scaled by the Allan variance of one of its terms,

    a(T) = 2 s^2 (r - r^2 (3 - 4 e^(-1/r) + e^(-2/r)) / 2),  r = tau / T  (n3)

Outputs (6, n) in m/s^2 and rad/s. Source: IEEE Std 952-1997, annex C.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.profile import NoiseFigures, Triad
from fieldcal.sim_device.random_process import (
    GaussMarkov,
    RandomProcess,
    Walk,
    random_stream,
)

FLICKER_TAU = 4.0 ** np.arange(8)
"""Correlation times of the terms of 1/f noise, s."""


class RandomErrors:
    """All random errors of a device."""

    def __init__(
        self, figures: NoiseFigures, rate: float, seed: int, ratio: Array
    ) -> None:
        self._white = ratio * white_sigma(figures, rate)
        self._rng = random_stream(seed, "white")
        self._slow: list[RandomProcess] = []
        walk = _six(figures.acc_walk, figures.gyr_walk)
        if walk.any():
            self._slow.append(Walk(walk, rate, random_stream(seed, "walk")))
        wander = _six(figures.acc_instability, figures.gyr_instability)
        if wander.any():
            rng = random_stream(seed, "instability")
            tau = figures.instability_s
            self._slow.append(GaussMarkov(wander, tau, rate, rng))
        flicker = _six(figures.acc_flicker, figures.gyr_flicker) * _flicker_scale()
        if flicker.any():
            rngs = random_stream(seed, "flicker").spawn(len(FLICKER_TAU))
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
    """Standard deviation of a term of (n2) for an Allan deviation of 1, by (n3)."""
    middle = np.sqrt(FLICKER_TAU[0] * FLICKER_TAU[-1])
    r = FLICKER_TAU / middle
    e = np.exp(-1 / r)
    return float(1 / np.sqrt(np.sum(2 * (r - r * r * (3 - 4 * e + e * e) / 2))))
