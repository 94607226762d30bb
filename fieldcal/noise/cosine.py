"""Variance of the cosine coefficients of a stretch, for each random process.

A series y_0 ... y_n-1 of means over m samples, dt apart, has the coefficients

    c_k = sqrt(2/n) sum_j y_j cos(pi k (j + 1/2) / n),     k = 1 ... n - 1         (1)

(DCT-II). White noise and random walk are independent in them, exactly: the coefficients
diagonalise the differences of a walk. Other processes nearly are; what is exact for all
is the variance of each coefficient, from the covariance of the series. With

    l_k = 2 - 2 cos(pi k / n)

    white noise N         N^2 / (m dt)                                             (2)
    quantisation Q        Q^2 (l_k + 4/n cos^2(pi k / 2n)) / (m dt)^2              (3)
    random walk K         K^2 dt (m / l_k - (m^2 - 1) / 6m)                        (4)
    Gauss-Markov s, T     s^2 (r + v (A_k(b) - 1)), b = exp(-m dt / T)             (5)
    A_k(b) = 1 + 2 Re G - 2/n Im H / sin w,         w = pi k / n, z = b exp(iw)    (6)
    G = sum (1 - h/n) z^h,  H = sum z^h,            h = 1 ... n - 1
    flicker B up to T     (5) with s^2 = B^2/pi for each e-fold of T               (7)

where r is the variance of a mean over m samples of a unit process, v b^h their
covariance. Two-sided densities as in IEEE 952-1997 annex C: N^2, B^2 / (2 pi f),
K^2 / (2 pi f)^2. Units: s, and those of the process.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array


def white(n: int, m: int, dt: float) -> Array:
    """Variance for N = 1 of k = 1 ... n - 1, (2)."""
    return np.full(n - 1, 1 / (m * dt))


def quantisation(n: int, m: int, dt: float) -> Array:
    """Variance for Q = 1 of k = 1 ... n - 1, (3)."""
    half = np.pi * np.arange(1, n) / (2 * n)
    step = 4 * np.sin(half) ** 2 + 4 / n * np.cos(half) ** 2
    variance: Array = step / (m * dt) ** 2
    return variance


def walk(n: int, m: int, dt: float) -> Array:
    """Variance for K = 1 of k = 1 ... n - 1, (4)."""
    step = 4 * np.sin(np.pi * np.arange(1, n) / (2 * n)) ** 2
    variance: Array = dt * (m / step - (m * m - 1) / (6 * m))
    return variance


def markov(n: int, m: int, dt: float, time: float) -> Array:
    """Variance for a process of unit variance and correlation time, s, (5)."""
    a = dt / time
    # of neighbouring means; further ones have exp(-m a) of it each
    next_one = (np.expm1(-m * a) / (m * np.expm1(-a))) ** 2 * np.exp(-a)
    variance: Array = next_one * _lag_sum(n, m * a) + _variance_of_mean(m, a)
    return variance


def _variance_of_mean(m: int, a: float) -> float:
    """Variance of a mean over m samples of exp(-a |h|)."""
    if m * a < 1e-3:  # the sum below would cancel
        return 1 - a * (m * m - 1) / (3 * m) + a * a * (m * m - 1) / 12
    one = -np.expm1(-a)
    g = np.exp(-a) / one * (1 + np.expm1(-m * a) / (m * one))
    return float((1 + 2 * g) / m)


@lru_cache(maxsize=4)
def _phase_factors(n: int) -> tuple[NDArray[np.complexfloating], Array]:
    """Factors exp(iw) of (6), and (-1)^k; cached for tables of many times."""
    k = np.arange(1, n)
    return np.exp(1j * np.pi * k / n), np.where(k % 2, -1.0, 1.0)


def _lag_sum(n: int, x: float) -> Array:
    """(A_k - 1) / b of (6) for b = exp(-x)."""
    turn, sign = _phase_factors(n)
    last = np.exp(-x * (n - 1)) * sign
    rest = 1 - np.exp(-x) * turn
    g = turn / rest - turn * (1 - np.exp(-x) * last) / (n * rest**2)
    h = (turn - last) / rest
    found: Array = 2 * g.real - 2 / n * h.imag / turn.imag
    return found
