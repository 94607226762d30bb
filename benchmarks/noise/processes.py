"""Random processes and what can be known of them, apart from the estimator."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from fieldcal.core.samples import Array, Block


def noise(
    rng: np.random.Generator, n: int, dt: float, channels: int = 6, **sizes: float
) -> Array:
    """Samples (n, channels): N, Q, K, B, ramp R; s and T of a Gauss-Markov process."""
    one: Array = sizes.get("N", 0.0) / np.sqrt(dt) * rng.standard_normal((n, channels))
    angle = sizes.get("Q", 0.0) * rng.standard_normal((n + 1, channels))
    one += np.diff(angle, axis=0) / dt
    steps = sizes.get("K", 0.0) * np.sqrt(dt) * rng.standard_normal((n, channels))
    one += np.cumsum(steps, axis=0) + sizes.get("R", 0.0) * dt * np.arange(n)[:, None]
    if "B" in sizes:  # Kasdin 1995: half a sum
        k = np.arange(1, n)
        half = np.concatenate([[1.0], np.cumprod((k - 0.5) / k)])
        white = np.fft.rfft(rng.standard_normal((n, channels)), 2 * n, axis=0)
        both = np.fft.rfft(half, 2 * n)[:, None] * white
        one += sizes["B"] * np.fft.irfft(both, 2 * n, axis=0)[:n]
    if "s" in sizes:
        a = np.exp(-dt / sizes["T"])
        steps = np.sqrt(1 - a * a) * rng.standard_normal((n, channels))
        steps[0] = rng.standard_normal(channels)
        one += sizes["s"] * lfilter([1.0], [1.0, -a], steps, axis=0)
    return one


def recording(values: Array, dt: float, temperature: Array | None = None) -> Block:
    """Six columns as samples."""
    t = np.arange(len(values)) * dt
    return Block.of(t, values[:, :3], values[:, 3:6], temperature)


def covariance(n: int, dt: float, process: str, time: float = 1.0) -> Array:
    """Covariance (n, n) of a process of unit size."""
    lag = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    if process == "N":
        return np.eye(n) / dt
    if process == "Q":
        return np.asarray((2.0 * (lag == 0) - (lag == 1)) / dt**2)
    if process == "K":
        return np.asarray(dt * (1.0 + np.minimum.outer(np.arange(n), np.arange(n))))
    if process == "G":
        return np.asarray(np.exp(-lag * dt / time))
    octave = np.arange(np.log(dt / 8), np.log(64 * n * dt), 0.05)
    return np.asarray(sum(np.exp(-lag * dt / np.exp(o)) for o in octave)) * 0.05 / np.pi


def bound(n: int, dt: float, sizes: dict[str, float]) -> Array:
    """Cramer-Rao bound of the relative error of each size, mean unknown, exactly."""
    steps = np.diff(np.eye(n), axis=0)  # the mean drops out of differences
    parts = [s**2 * steps @ covariance(n, dt, p) @ steps.T for p, s in sizes.items()]
    inverse = np.linalg.inv(sum(parts))
    white = [inverse @ part for part in parts]
    information = [[0.5 * np.sum(a * b.T) for a in white] for b in white]
    return np.asarray(np.sqrt(np.diag(np.linalg.inv(information))) / 2)
