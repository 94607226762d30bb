"""Draws logs of a device that lies still; shares nothing with the estimator.

A knock lets the device swing about every axis and ring, and leaves it as it lay:

    angle_i = A_i exp(-s / T) sin(2 pi f s),  force_i = B_i exp(-s / T) sin(2 pi h_i s)

s after it, s; the gyroscopes give the mean rate since the sample before, or the rate of
the instant, which aliases. A nudge turns the device for good besides.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fieldcal.core.samples import Array

G = 9.81

KINDS = (
    "nothing", "nothing", "temperature", "settling", "step", "walk", "shock", "nudge",
)  # fmt: skip


class Still(NamedTuple):
    """A log.

    Attributes
    ----------
    kind : what is drawn beside noise and knocks
    t, six, warm : (n,) s, (n, 6) SI, (n,) deg C
    knocks : (k,) instants, s
    turned : instant from which the device lies otherwise, s; nan if it never does

    """

    kind: str
    t: Array
    six: Array
    warm: Array
    knocks: Array
    turned: float


def draw(seed: int) -> Still:
    """Draw a log; the kinds come in turn, each without knocks and with them."""
    rng = np.random.default_rng(seed)
    kind, rate = KINDS[seed % len(KINDS)], float(rng.choice([10, 25, 50, 100]))
    lasts = _between(rng, 120.0, 21_600.0)
    t = np.arange(int(rate * lasts)) / rate
    white = np.repeat([_between(rng, 1e-3, 2e-2), _between(rng, 2e-4, 3e-3)], 3)
    level = np.repeat([_between(rng, 3e-5, 1e-3), _between(rng, 3e-6, 1e-4)], 3)
    up = rng.normal(size=3)
    up *= G / np.linalg.norm(up)
    six = np.r_[up, 0, 0, 0] + rng.normal(0, np.repeat([0.05, 0.005], 3))
    six = six + white * rng.standard_normal((len(t), 6))
    unlike = np.exp(rng.normal(0, 0.2, 6))
    for c in range(6):
        six[:, c] += level[c] * unlike[c] * _flicker(rng, len(t), rate)
    warm = 25 + 6 * (1 - np.exp(-t / (rng.uniform(0.05, 0.4) * lasts)))
    warm += rng.uniform(0.5, 1.5) * np.sin(2 * np.pi * t / lasts * rng.uniform(1, 3))
    knocks = np.empty(0)
    if seed // len(KINDS) % 2 or kind == "shock":
        knocks = np.sort(rng.uniform(0.05, 0.95, int(rng.integers(1, 13)))) * lasts
    at = float(t[-1] * rng.uniform(0.2, 0.8))
    if kind == "shock":
        at = float(rng.choice(knocks))
    _spoil(kind, rng, t, six, warm, at)
    turned = float("nan")
    if kind == "nudge":
        knocks, turned = np.sort(np.append(knocks, at)), at
    averaging = bool(rng.integers(2))
    for one in knocks:
        _knock(rng, t, six, up, float(one), one == turned, averaging)
    return Still(kind, t, six, warm, knocks, turned)


def _spoil(
    kind: str, rng: np.random.Generator, t: Array, six: Array, warm: Array, at: float
) -> None:
    """Add what a bias does."""
    lasts, axis = t[-1], int(rng.integers(3))
    if kind == "temperature":
        six[:, axis] += rng.uniform(2e-3, 1e-2) * (warm - 25)
    if kind == "settling":
        gone = np.exp(-t / (rng.uniform(0.05, 0.4) * lasts))
        six[:, [axis, 3 + axis]] += gone[:, None] * rng.uniform(
            [1e-2, 5e-4], [4e-2, 2e-3]
        )
    if kind == "step":
        six[t > at, 3 + axis] += rng.uniform(1e-3, 3e-3)
    if kind == "shock":
        six[t > at, axis] += rng.uniform(1e-2, 5e-2)
    if kind == "walk":
        steps = rng.standard_normal((len(t), 3)) / np.sqrt(len(t))
        six[:, 3:] += rng.uniform(1e-3, 3e-3) * np.cumsum(steps, axis=0)


def _knock(
    rng: np.random.Generator,
    t: Array,
    six: Array,
    up: Array,
    at: float,
    turns: bool,
    averaging: bool,
) -> None:
    """Add a knock, which may turn the device by 0.02 to 0.3 deg for good."""
    step = t[1] - t[0]
    first = int(np.searchsorted(t, at - 2 * step))
    near = slice(first, first + int(6.0 / step))
    fades, hz = rng.uniform(0.1, 0.4), rng.uniform(3, 20)
    swing = np.deg2rad(_between(rng, 0.02, 0.3)) * rng.normal(size=3)
    ring, pitch = _between(rng, 0.1, 5.0) * rng.normal(size=3), rng.uniform(5, 60, 3)
    for_good = np.zeros(3)
    if turns:
        for_good = rng.normal(size=3)
        for_good *= np.deg2rad(_between(rng, 0.02, 0.3)) / np.linalg.norm(for_good)

    def angle(times: Array) -> Array:
        s = np.maximum(times - at, 0.0)[:, None]
        rung = swing * np.exp(-s / fades) * np.sin(2 * np.pi * hz * s)
        out: Array = rung + for_good * (1 - np.exp(-s / 0.1))
        return out

    def rate(short: float) -> Array:
        return (angle(t[near]) - angle(t[near] - short)) / short

    s = np.maximum(t[near] - at, 0.0)[:, None]
    rung = ring * np.exp(-s / fades) * np.sin(2 * np.pi * pitch * s)
    six[near, 3:] += rate(step if averaging else 1e-6)
    six[near, :3] += np.cross(up, angle(t[near])) + rung
    six[near.stop :, :3] += np.cross(up, for_good)


def _between(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _flicker(rng: np.random.Generator, n: int, rate: float) -> Array:
    """Noise of the one-sided power 1 / (pi f), as far down as twice n shows."""
    spectrum = np.fft.rfft(rng.standard_normal(2 * n))
    f = np.fft.rfftfreq(2 * n, 1 / rate)
    f[0] = np.inf
    course = np.fft.irfft(spectrum / np.sqrt(f), 2 * n)[:n]
    out: Array = course * np.sqrt(rate / (2 * np.pi))
    return out
