"""Noise of every colour, and devices at rest that have it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.signal import butter, lfilter

from fieldcal.core.samples import Array, Block

UNIT = np.repeat([0.05, 0.002], 3)
HOME = np.array([0.1, -9.81, 0.2, 0.01, -0.02, 0.005])


def white(rng: np.random.Generator, n: int, c: int = 6) -> Array:
    return rng.standard_normal((n, c))


def low_passed(hz: float, rate: float = 100.0) -> Callable[..., Array]:
    def source(rng: np.random.Generator, n: int, c: int = 6) -> Array:
        b, a = butter(2, 2 * hz / rate)
        x: Array = lfilter(b, a, white(rng, n + 200, c), axis=0)[200:]
        scaled: Array = x / x.std()
        return scaled

    return source


def markov(phi: float) -> Callable[..., Array]:
    def source(rng: np.random.Generator, n: int, c: int = 6) -> Array:
        e = np.sqrt(1 - phi**2) * white(rng, n + 300, c)
        x: Array = lfilter([1], [1, -phi], e, axis=0)[300:]
        return x

    return source


def flicker(knee: float, rate: float = 100.0) -> Callable[..., Array]:
    def source(rng: np.random.Generator, n: int, c: int = 6) -> Array:
        f = np.fft.rfftfreq(2 * n, 1 / rate)[1:, None]
        spectrum = white(rng, n, c) + 1j * white(rng, n, c)
        spectrum = np.vstack([np.zeros((1, c)), spectrum * np.sqrt((1 + knee / f) * n)])
        return np.fft.irfft(spectrum, 2 * n, axis=0)[:n]

    return source


def block_of(noise: Array, rate: float = 100.0, start: float = 0.0) -> Block:
    six = HOME + noise * UNIT
    t = start + np.arange(len(six)) / rate
    return Block.of(t, six[:, :3], six[:, 3:], np.full(len(t), 25.0))
