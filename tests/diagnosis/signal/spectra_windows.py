"""Windows of noise, and of a line in it, for what looks at spectra."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.diagnosis.signal.pieces import WindowSamples
from fieldcal.physics.experience import Experience

RATE = 200.0
NOISE = np.full(6, 1e-3)


def pieces(times: Sequence[Array], samples: Sequence[Array]) -> WindowSamples:
    """Windows of one device that was never turned."""
    still = np.zeros(len(times))
    x = Experience.at_rest(still, still, 9.81)
    return WindowSamples(x, tuple(samples), tuple(times), NOISE, RATE)


def late(rng: np.random.Generator, n: int) -> Array:
    """Times of which every thirtieth or so is a fifth of a period late for good."""
    steps = np.where(rng.random(n) < 1 / 30, 1.2, 1.0) / RATE
    return np.cumsum(steps)


def noise(rng: np.random.Generator, n: int) -> Array:
    """White noise in all outputs."""
    return NOISE * rng.standard_normal((n, 6))


def windows_of(seed: int, size: float) -> WindowSamples:
    """Fifteen windows with a line of 41.9 Hz in one output, too weak for one window."""
    rng = np.random.default_rng(seed)
    starts = 8.0 * np.arange(15) + np.round(rng.uniform(0, 2, 15) * RATE) / RATE
    times = [np.arange(800) / RATE + start for start in starts]
    samples = [noise(rng, len(t)) for t in times]
    for t, six in zip(times, samples, strict=True):
        six[:, 5] += size * np.sin(2 * np.pi * 41.9 * t)
    return pieces(times, samples)
