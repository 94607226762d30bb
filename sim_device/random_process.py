"""Random numbers of a device, and the processes that wander.

    Gauss-Markov x_k = c x_(k-1) + s sqrt(1 - c^2) z_k,  c = exp(-1 / (rate tau))  (p1)
    random walk  x_k = x_(k-1) + s z_k / sqrt(rate)                 (p2)

z_k are standard normal. Six channels, m/s^2 and rad/s, the same however they are drawn
in pieces. Source: IEEE Std 952-1997, annex C.
"""

from __future__ import annotations

from typing import Protocol
from zlib import crc32

import numpy as np

from fieldcal.core.samples import Array

BLOCK = 64
"""Ticks of the sampling clock that a Gauss-Markov process is calculated in."""


def random_stream(seed: int, name: str) -> np.random.Generator:
    """Random numbers for one purpose, apart from those of every other."""
    return np.random.default_rng([seed, crc32(name.encode())])


class RandomProcess(Protocol):
    """Random process with one step for each tick of the sampling clock."""

    def draw(self, n: int) -> Array:
        """Next `n` values, (6, n)."""


class Walk:
    """Random walk (p2) of six channels; `size` (6,) per sqrt(s)."""

    def __init__(self, size: Array, rate: float, rng: np.random.Generator) -> None:
        self._step = size / np.sqrt(rate)
        self._rng = rng
        self._last: Array = np.zeros((1, 6))

    def draw(self, n: int) -> Array:
        """Next `n` values, (6, n)."""
        steps = self._step * self._rng.standard_normal((n, 6))
        path: Array = np.cumsum(np.concatenate([self._last, steps]), axis=0)  # (p2)
        self._last = path[-1:]
        walked: Array = path[1:].T
        return walked


class GaussMarkov:
    """Bias (p1) with the standard deviation `size` (6,).

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
            x[:, j] += self._keep * x[:, j - 1]  # (p1)
        fading = self._keep ** np.arange(1, BLOCK + 1)[:, None]
        for block in x:
            block += fading * self._last
            self._last = block[-1].copy()
        return x.reshape(-1, 6)
