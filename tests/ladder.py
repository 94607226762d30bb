"""A second virtual device, of a few lines, that shares nothing with the first.

It is turned by hand: first about alpha, then about beta, as an operator does. The
force and the rate follow from the angles by rotation matrices; what a device has wrong
is added to outputs by functions of what it goes through.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Block

Array = NDArray[np.float64]
LADDER = (
    *((0, 0), (22.5, 0), (45, 0), (45, 5), (22.5, 5), (0, 5)),
    *((-22.5, 2.5), (-45, 5), (-45, 0)),
)
LATITUDE_DEG, HEIGHT_M = 50.45, 170.0
GRAVITY = 9.810578
EARTH = 7.292115e-5
WINDOW_S, GAP_S, LEAD_S = 30.0, 9.0, 3.0


@dataclass(frozen=True)
class Device:
    """Noise of a sample, m/s^2 and rad/s, and calibration."""

    rate_hz: float = 50.0
    acc_noise: float = 0.003
    gyr_noise: float = 2e-4
    acc_bias: tuple[float, float, float] = (-0.3, 0.15, 0.07)
    acc_scale: tuple[float, float, float] = (0.993, 1.008, 1.001)
    gyr_bias: tuple[float, float, float] = (-0.004, 0.012, 0.02)


TACTICAL = Device()
NAVIGATION = Device(
    100.0,
    6e-4,
    3e-6,
    (0.01, -0.02, 0.015),
    (1.0005, 0.9995, 1.0002),
    (2e-5, -1e-5, 3e-5),
)


@dataclass
class Ride:
    """What a device goes through: n samples.

    Attributes
    ----------
    t : (n,) s
    f, w : (n, 3) specific force, m/s^2, and angular rate, rad/s
    warming : (n,) K since the start
    held : (n,) number of the position, -1 on the way
    turned : (n,) direction of the last turn about alpha: -1, 0, 1
    rng : for what is random

    """

    t: Array
    f: Array
    w: Array
    warming: Array
    held: NDArray[np.int_]
    turned: Array
    rng: np.random.Generator


Fault = Callable[[Ride, Array], None]
"""Changes outputs, (n, 6)."""


def windows() -> list[tuple[float, float]]:
    """Start and end of each window, s."""
    starts = LEAD_S + (WINDOW_S + GAP_S) * np.arange(len(LADDER))
    return [(float(s), float(s) + WINDOW_S) for s in starts]


def _courses(t: Array, angles: Array) -> tuple[Array, Array]:
    """Alpha and beta over time, rad: alpha is set first, and beta then."""
    out = np.tile(np.deg2rad(angles[0]), (len(t), 1))
    for i, (start, _) in enumerate(windows()[1:], start=1):
        for joint, begin in ((0, start - 7.5), (1, start - 5.0)):
            x = np.clip((t - begin) / 2.5, 0.0, 1.0)
            way = x**3 * (10 - 15 * x + 6 * x**2)
            out[:, joint] += np.deg2rad(angles[i, joint] - angles[i - 1, joint]) * way
    return out[:, 0], out[:, 1]


def _seen(vector: Array, alpha: Array, beta: Array) -> Array:
    """A vector of the base in the device's axes, (n, 3)."""
    x = np.cos(alpha) * vector[0] + np.sin(alpha) * vector[1]
    y = -np.sin(alpha) * vector[0] + np.cos(alpha) * vector[1]
    return np.column_stack(
        [
            x,
            np.cos(beta) * y + np.sin(beta) * vector[2],
            -np.sin(beta) * y + np.cos(beta) * vector[2],
        ]
    )


def ride(device: Device, seed: int, setting_deg: float = 0.0) -> Ride:
    """Through the ladder's positions, set by hand to within some degrees."""
    rng = np.random.default_rng(seed)
    dt = 1 / device.rate_hz
    t = np.arange(0.0, windows()[-1][1] + LEAD_S, dt)
    angles = np.array(LADDER) + setting_deg * rng.standard_normal((len(LADDER), 2))
    alpha, beta = _courses(t, angles)
    phi = np.deg2rad(LATITUDE_DEG)
    earth = EARTH * np.array([0.0, -np.sin(phi), np.cos(phi)])
    a, b = np.gradient(alpha, dt), np.gradient(beta, dt)
    w = np.column_stack([b, np.sin(beta) * a, np.cos(beta) * a])
    held = np.full(len(t), -1)
    turned = np.zeros(len(t))
    for i, (start, end) in enumerate(windows()):
        held[(t >= start) & (t < end)] = i
        if i:
            turned[t >= start - GAP_S] = np.sign(LADDER[i][0] - LADDER[i - 1][0])
    f = _seen(np.array([0.0, -GRAVITY, 0.0]), alpha, beta)
    warming = 6 * (1 - np.exp(-t / 175.0))
    return Ride(t, f, w + _seen(earth, alpha, beta), warming, held, turned, rng)


def record(device: Device, ridden: Ride, faults: Sequence[Fault] = ()) -> Block:
    """What the device puts out."""
    out = np.hstack([device.acc_bias + ridden.f * device.acc_scale,
                     device.gyr_bias + ridden.w])  # fmt: skip
    for fault in faults:
        fault(ridden, out)
    noise = np.repeat([device.acc_noise, device.gyr_noise], 3)
    out += noise * ridden.rng.standard_normal(out.shape)
    warm = np.round(ridden.rng.normal(25 + ridden.warming, 0.02), 3)
    return Block.of(ridden.t, out[:, :3], out[:, 3:], warm)
