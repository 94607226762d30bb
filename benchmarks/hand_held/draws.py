"""A device that is turned about and laid down, as somebody without a fixture would.

Nothing of this is shared with what estimates: rotations are quaternions of their own,
a turn is 1 - cos of the time about an axis of the device, a hand trembles in angle at
0.3 to 9 Hz, each sample is the mean over its interval. Device axes, SI units.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array

GRAVITY = 9.81
FINE = 8
"""Steps in a sample."""

COUNTS_A_G = (0.0, 16384.0, 8192.0, 4096.0)
COUNTS_A_DEG_S = (0.0, 131.0, 65.5, 16.4)
"""Resolutions of usual devices, 0 for a fine one."""

CONSTANT = 200.0
"""Time constant of the warming, s."""


@dataclass(frozen=True)
class Device:
    """What a device does to the force and the rate that it feels.

    Attributes
    ----------
    acc_bias, gyr_bias : (3,) m/s^2 and rad/s
    acc, gyr : (3, 3) outputs of each axis by what acts along all three
    noise : (2,) of a sample, m/s^2 and rad/s
    warmth : (6,) change of the biases in a kelvin
    walk : rad/s in sqrt(s), by which gyroscope biases walk
    counts : (2,) in a g and in a deg/s, 0 for a fine one

    """

    acc_bias: Array
    gyr_bias: Array
    acc: Array
    gyr: Array
    noise: tuple[float, float]
    warmth: Array
    walk: float
    counts: tuple[float, float]


@dataclass(frozen=True)
class Log:
    """What was written down.

    Attributes
    ----------
    rows : (n, 8) s, m/s^2, rad/s, degC
    device : it was written by
    places : in which it was held
    tremor : of the hand, rad; 0 on a table

    """

    rows: Array
    device: Device
    places: int
    tremor: float


def log(seed: int) -> Log:
    """Draw a device, how it is turned, and what it writes down."""
    rng = np.random.default_rng(seed)
    rate = float(rng.choice([50.0, 100.0, 200.0]))
    places = int(rng.integers(8, 30))
    tremor = 0.0 if rng.random() < 0.5 else float(10 ** rng.uniform(-3.3, -2.3))
    parts = list(_turned(rng, rate, places, tremor))
    force, turning = (np.concatenate(one) for one in zip(*parts, strict=True))
    force, turning = (one.reshape(-1, FINE, 3).mean(axis=1) for one in (force, turning))
    device = _device(rng)
    t = np.arange(len(force)) / rate
    celsius = 25.0 + 8.0 * (1.0 - np.exp(-t / CONSTANT))
    six = _outputs(rng, device, force, turning, celsius - celsius[0], rate)
    if rng.random() < 0.3:
        t = t + rng.normal(0.0, 3e-4, len(t))
    rows = np.column_stack([t, six, np.round(celsius, 1)])
    if rng.random() < 0.2:
        rows = rows[rng.random(len(rows)) > 0.002]
    return Log(rows, device, places + 1, tremor)


def _device(rng: np.random.Generator) -> Device:
    """An uncalibrated one of consumer grade; one of three warms, one of three walks."""
    kind = int(rng.integers(3))
    warmth = rng.normal(0.0, np.repeat([4e-3, 8e-4], 3)) * (kind == 1)
    walk = float(10 ** rng.uniform(-5.0, -4.0)) * (kind == 2)
    return Device(
        rng.normal(0.0, [0.15, 0.15, 0.25]),
        rng.normal(0.0, 0.03, 3),
        _mixing(rng, 0.008, 0.006),
        _mixing(rng, 0.01, 0.008),
        (float(10 ** rng.uniform(-2.5, -1.5)), float(10 ** rng.uniform(-3.3, -2.3))),
        warmth,
        walk,
        (float(rng.choice(COUNTS_A_G)), float(rng.choice(COUNTS_A_DEG_S))),
    )


def _mixing(rng: np.random.Generator, scale: float, across: float) -> Array:
    """Scale factors and cross-coupling, (3, 3)."""
    mixed = np.eye(3) + across * rng.standard_normal((3, 3)) * (1 - np.eye(3))
    out: Array = (1 + scale * rng.standard_normal(3))[:, None] * mixed
    return out


def _turned(
    rng: np.random.Generator, rate: float, places: int, tremor: float
) -> Iterator[tuple[Array, Array]]:
    """Force and rate while it is held and turned in turn, (n, 3) each."""
    attitude = np.array([1.0, 0.0, 0.0, 0.0])
    least, most = float(rng.uniform(2.0, 4.0)), float(rng.uniform(4.0, 9.0))
    yield _held(rng, attitude, float(rng.uniform(3.0, 30.0)), rate, tremor)
    for _ in range(places):
        axis = rng.standard_normal(3)
        axis /= np.linalg.norm(axis)
        angle, lasts = float(rng.uniform(0.6, 2.6)), float(rng.uniform(1.0, 3.0))
        steps = int(lasts * rate) * FINE
        part = np.arange(steps + 1) / steps
        way = angle * (part - np.sin(2 * np.pi * part) / (2 * np.pi))
        middle = (way[1:] + way[:-1]) / 2
        up = np.array([_up(_times(attitude, _about(axis, a))) for a in middle])
        push = 0.8 * np.sin(np.pi * part[1:]) ** 2
        force = GRAVITY * up + push[:, None] * rng.standard_normal(3)
        yield force, np.diff(way)[:, None] * rate * FINE * axis
        attitude = _times(attitude, _about(axis, angle))
        yield _held(rng, attitude, float(rng.uniform(least, most)), rate, tremor)


def _held(
    rng: np.random.Generator, attitude: Array, lasts: float, rate: float, tremor: float
) -> tuple[Array, Array]:
    """Force and rate while it is held, by a hand if that trembles."""
    t = np.arange(int(lasts * rate) * FINE) / (rate * FINE)
    hz = rng.uniform(0.3, 9.0, (5, 3))
    size = tremor / (1 + hz) * rng.standard_normal((5, 3))
    phase = np.multiply.outer(t, 2 * np.pi * hz) + rng.uniform(0.0, 6.28, (5, 3))
    angle = (size * np.sin(phase)).sum(axis=1)
    turning = (size * 2 * np.pi * hz * np.cos(phase)).sum(axis=1)
    push = -(0.06 * size * (2 * np.pi * hz) ** 2 * np.sin(phase)).sum(axis=1)
    up = _up(attitude)
    return GRAVITY * (up - np.cross(angle, up)) + push, turning


def _outputs(
    rng: np.random.Generator,
    device: Device,
    force: Array,
    turning: Array,
    warmer: Array,
    rate: float,
) -> Array:
    """What the device writes down, (n, 6)."""
    bias = np.concatenate([device.acc_bias, device.gyr_bias])
    out: Array = np.hstack([force @ device.acc.T, turning @ device.gyr.T]) + bias
    out += warmer[:, None] * device.warmth
    step = device.walk / np.sqrt(rate)
    out[:, 3:] += np.cumsum(step * rng.standard_normal(turning.shape), axis=0)
    out += np.repeat(device.noise, 3) * rng.standard_normal(out.shape)
    units = (9.80665, np.pi / 180)
    for k, (counts, unit) in enumerate(zip(device.counts, units, strict=True)):
        if counts:
            some = out[:, 3 * k : 3 * k + 3]
            out[:, 3 * k : 3 * k + 3] = np.round(some / unit * counts) / counts * unit
    return out


def _about(axis: Array, angle: float) -> Array:
    """Quaternion of a turn about a unit vector."""
    return np.concatenate([[np.cos(angle / 2)], np.sin(angle / 2) * axis])


def _times(a: Array, b: Array) -> Array:
    """Product of two quaternions: b, in the axes that a has turned."""
    w = a[0] * b[0] - a[1:] @ b[1:]
    return np.concatenate([[w], a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])])


def _up(q: Array) -> Array:
    """Up in the axes of a device of some attitude, (3,)."""
    w, x, y, z = q
    return np.array([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)])
