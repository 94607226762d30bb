"""A device that is turned by hand from rest to rest, and what its sensors put out.

Written apart from everything that reads it. With R from the world to the device,

    u = R z,   du/dt = u x w,   A = K g u + b + noise,   W = L w + c + noise
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

G = 9.80665


@dataclass(frozen=True)
class Handling:
    """How a device is handled.

    Attributes
    ----------
    positions : rests
    hold, turn : s at rest and on the way
    rate : samples a second
    wobble : rms of a hand's turning at rest, rad/s
    slow : rate at which a rest turns slowly, rad/s
    hum : amplitude of a vibration, m/s^2
    swing : largest rate on the way, deg/s; sets how fast the turns are

    """

    positions: int
    hold: float
    turn: float
    rate: float
    wobble: float = 0.0
    slow: float = 0.0
    hum: float = 0.0


@dataclass(frozen=True)
class Moved:
    """What a device went through.

    Attributes
    ----------
    t : (n,) s
    up : (n, 3) direction of the specific force, device axes
    w : (n, 3) rad/s
    rests : (p, 2) first and one past the last row of each rest

    """

    t: Floats
    up: Floats
    w: Floats
    rests: NDArray[np.int64]


def moved(handling: Handling, rng: np.random.Generator) -> Moved:
    """Turn a device from rest to rest about axes drawn at random."""
    h, rows = handling, []
    rests, n = [], 0
    for p in range(h.positions):
        k = max(4, round(h.hold * rng.uniform(0.8, 1.4) * h.rate))
        rests.append((n, n + k))
        rows.append(_at_rest(h, k, rng))
        n += k
        if p + 1 < h.positions:
            m = max(4, round(h.turn * rng.uniform(0.8, 1.2) * h.rate))
            axis = rng.normal(size=3)
            angle = rng.uniform(1.0, 2.6)
            shape = 1 - np.cos(2 * np.pi * (np.arange(m) + 0.5) / m)
            speed = angle * h.rate / m * shape
            rows.append(speed[:, None] * axis / np.linalg.norm(axis))
            n += m
    w = np.concatenate(rows)
    return Moved(np.arange(n) / h.rate, _carried(w, h.rate), w, np.array(rests))


def _at_rest(h: Handling, k: int, rng: np.random.Generator) -> Floats:
    t = np.arange(k) / h.rate
    w = np.zeros((k, 3))
    for i in range(3 if h.wobble else 0):
        for hz in rng.uniform(0.3, 3.0, 3):
            w[:, i] += h.wobble * np.sin(2 * np.pi * (hz * t + rng.uniform()))
    w[:, rng.integers(3)] += h.slow
    return w


def _carried(w: Floats, rate: float) -> Floats:
    """Direction of the force (n, 3) as the device turns, by exact small turns."""
    out = np.empty_like(w)
    x, y, z = 0.0, 0.0, 1.0
    for i, (p, q, r) in enumerate(w.tolist()):
        out[i] = x, y, z
        size = (p * p + q * q + r * r) ** 0.5
        if not size:
            continue
        p, q, r = p / size, q / size, r / size
        s, c = -np.sin(size / rate), np.cos(size / rate)
        along = (p * x + q * y + r * z) * (1 - c)
        x, y, z = (
            x * c + (q * z - r * y) * s + p * along,
            y * c + (r * x - p * z) * s + q * along,
            z * c + (p * y - q * x) * s + r * along,
        )
    return out


def outputs(
    moved: Moved, handling: Handling, noise: float, off: float, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """Accelerometers and gyroscopes (n, 3) of one device, m/s^2 and rad/s.

    Parameters
    ----------
    moved, handling : what it goes through
    noise : rms of the accelerometers' samples, m/s^2; of the gyroscopes a tenth, rad/s
    off : scale factor of all its accelerometers
    rng : draws the device

    """
    gain = off * (np.eye(3) + np.diag(rng.normal(0, 3e-3, 3)))
    gain[0, 1] = rng.normal(0, 3e-3)
    acc = G * moved.up @ gain.T + rng.normal(0, 0.05, 3)
    if handling.hum:
        hz = rng.uniform(0.2, 0.45) * handling.rate
        wave = np.sin(2 * np.pi * hz * moved.t)[:, None]
        acc += handling.hum * wave * rng.normal(size=3)
    gyr = moved.w * (1 + rng.normal(0, 5e-3, 3)) + rng.normal(0, 5e-3, 3)
    acc += rng.normal(0, noise, acc.shape)
    return acc, gyr + rng.normal(0, noise / 10, gyr.shape)
