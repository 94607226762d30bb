"""A motion program of its own: numpy, and nothing else.

A body moves along sums of sines, in place and in attitude. Its IMU sits off the centre
and is read by a clock of its own; its outputs may be off in all ways that a strap-down
IMU is. Nothing here is shared with what estimates. SI units; z up, f = (0, 0, g) at
rest.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

GRAVITY, TINY = 9.8106, 1e-3


class Drive:
    """One drawn motion: places (m) and angles (rad) as sums of sines."""

    def __init__(
        self, seed: int, brisk: float = 1.0, amplitude: float = 0.35, waves: int = 7
    ) -> None:
        rng = np.random.default_rng(seed)
        self.hz = brisk * np.exp(rng.uniform(np.log(0.05), np.log(1.2), (6, waves)))
        size = amplitude / np.sqrt(waves) * rng.uniform(0.5, 1.5, (6, waves))
        size[:3] *= 2.0 / (0.3 + self.hz[:3] ** 1.5)
        self.sine = size * np.exp(2j * np.pi * rng.random((6, waves)))

    def course(self, t: Any, order: int = 0) -> Any:
        """Place and angles, or a derivative of them, (n, 6)."""
        turn = 2j * np.pi * self.hz
        waves = np.exp(np.multiply.outer(t, turn)) * self.sine * turn**order
        return waves.imag.sum(axis=2)

    def axes(self, t: Any) -> Any:
        """Rows are the axes of the body in the world, (n, 3, 3)."""
        out = np.broadcast_to(np.eye(3), (len(t), 3, 3))
        angles = self.course(t)[:, 3:]
        for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
            one = np.tile(np.eye(3), (len(t), 1, 1))
            c, s = np.cos(angles[:, i]), np.sin(angles[:, i])
            one[:, j, j] = one[:, k, k] = c
            one[:, j, k], one[:, k, j] = s, -s
            out = one @ out
        return out

    def rate(self, t: Any) -> Any:
        """Angular rate in body axes, (n, 3): C' C^T = -[w x]."""
        change = (self.axes(t + TINY) - self.axes(t - TINY)) / (2 * TINY)
        step = change @ np.swapaxes(self.axes(t), 1, 2)
        pairs = ((1, 2), (2, 0), (0, 1))
        return np.stack([(step[:, i, j] - step[:, j, i]) / 2 for i, j in pairs], axis=1)

    def force(self, t: Any, arm: Any = (0.0, 0.0, 0.0)) -> Any:
        """Specific force at a place of the body, in body axes, (n, 3)."""
        world = self.course(t, 2)[:, :3] + [0.0, 0.0, GRAVITY]
        held = [np.swapaxes(self.axes(t + k * TINY), 1, 2) @ np.asarray(arm, float)
                for k in (-1, 0, 1)]  # fmt: skip
        world = world + (held[0] - 2 * held[1] + held[2]) / TINY**2
        return (self.axes(t) @ world[:, :, None])[:, :, 0]


class Shaken(Drive):
    """A motion of all frequencies up to 24 Hz, the weaker, the quicker it is."""

    def __init__(self, seed: int, waves: int = 250) -> None:
        rng = np.random.default_rng(seed)
        self.hz = np.exp(rng.uniform(np.log(0.1), np.log(24.0), (6, waves)))
        place, angle = 0.16 * self.hz[:3] ** -3.2, 0.25 * self.hz[3:] ** -2.2
        size = np.concatenate([place, angle]) * rng.uniform(0.5, 1.5, (6, waves))
        phase = np.exp(2j * np.pi * rng.random((6, waves)))
        self.sine = size / np.sqrt(waves) * phase


def low_passed(drive: Drive, t: Any, arm: Any, tau: float, gyro: bool) -> Any:
    """A channel triad after a first-order low-pass: Simpson's rule over its past."""
    ages = np.linspace(0.0, 16.0, 65)
    return _over_the_past(drive, t, arm, gyro, tau * ages, np.exp(-ages))


def butterworth(drive: Drive, t: Any, arm: Any, tau: float, gyro: bool) -> Any:
    """The same after a Butterworth low-pass of second order."""
    ages = np.linspace(0.0, 24.0, 121)
    ring = np.exp(-ages / np.sqrt(2)) * np.sin(ages / np.sqrt(2))
    return _over_the_past(drive, t, arm, gyro, tau * ages, ring)


def on_a_mount(drive: Drive, t: Any, arm: Any, compliance: Any) -> Any:
    """Force on a structure with a mode along each axis: 1 / (2 pi hz)^2, in s^2."""
    damping = 0.1
    ages = np.linspace(0.0, 10.0 / damping, 401)
    ring = np.sqrt(1 - damping**2)
    weights = (1 - 2 * damping**2) / ring * np.sin(ring * ages)
    weights = np.exp(-damping * ages) * (weights + 2 * damping * np.cos(ring * ages))
    out = drive.force(t, arm)
    for i, b in enumerate(compliance):
        if b:
            past = _over_the_past(drive, t, arm, False, np.sqrt(b) * ages, weights)
            out[:, i] = past[:, i]
    return out


def incremented(drive: Drive, t: Any, arm: Any, seconds: float) -> Any:
    """Force and rate as increments from t on, of velocity in the axes then."""
    from scipy.spatial.transform import Rotation

    start, parts = drive.axes(t), 16
    force = np.zeros((len(t), 3))
    for k in range(parts):
        now = t + (k + 0.5) / parts * seconds
        back = start @ np.swapaxes(drive.axes(now), 1, 2)
        force += (back @ drive.force(now, arm)[:, :, None])[:, :, 0] / parts
    turned = start @ np.swapaxes(drive.axes(t + seconds), 1, 2)
    return force, Rotation.from_matrix(turned).as_rotvec() / seconds


def _over_the_past(
    drive: Drive, t: Any, arm: Any, gyro: bool, ages: Any, weights: Any
) -> Any:
    weights = weights * np.where(np.arange(len(ages)) % 2, 4.0, 2.0)
    weights[[0, -1]] /= 2.0
    seen = (drive.rate(t - a) if gyro else drive.force(t - a, arm) for a in ages)
    total = sum(w * one for w, one in zip(weights, seen, strict=True))
    return total / weights.sum()


def coloured(rng: Any, n: int, step: float, noise: Mapping[str, Any]) -> Any:
    """White noise, a walk, and a first-order process, (n, 6), of given sizes (6,)."""
    six = np.ones(6)
    white = noise.get("white", 0.0) * six * rng.standard_normal((n, 6))
    walk = noise.get("walk", 0.0) * six * np.cumsum(rng.standard_normal((n, 6)), axis=0)
    out = white + walk * np.sqrt(step)
    tau, size = noise.get("tau", 1.0), noise.get("markov", 0.0) * six
    if np.any(size):
        from scipy.signal import lfilter

        keep = np.exp(-step / tau)
        drive = rng.standard_normal((n, 6)) * np.sqrt(1 - keep**2)
        out = out + size * lfilter([1.0], [1.0, -keep], drive, axis=0)
    return out


def recorded(
    drive: Drive, device: Mapping[str, Any], seconds: float = 120.0, hz: float = 50.0
) -> Any:
    """Times and outputs of an IMU on the body, (n, 7).

    `device` may have "start" (s of the motion), "clock" (delay s and rate), "turn" (R),
    "arm", "bias", "matrix_acc", "matrix_gyr", "g" (3, 3), "late" of the gyroscopes,
    "lag" or "second" (time constants of both triads, of first or second order), "cubic"
    (3,), "interval" (s of increments), "compliance" (3,) of a mount, "noise", "jitter"
    (s by which stamps are off, one sigma) and "seed".
    """
    rng = np.random.default_rng(device.get("seed", 0))
    n = int(seconds * hz)
    stamped = np.arange(n) / hz
    delay, rate = device.get("clock", (0.0, 0.0))
    t = device.get("start", 0.0) + (stamped - delay) * (1 + rate)
    arm = np.asarray(device.get("arm", (0.0, 0.0, 0.0)), float)
    turn = np.asarray(device.get("turn", np.eye(3)), float)
    late, lags = device.get("late", 0.0), device.get("lag", (0.0, 0.0))
    arm = turn.T @ arm
    second = device.get("second", (0.0, 0.0))
    f, w = drive.force(t, arm), drive.rate(t - late)
    for passes, (acc, gyr) in ((low_passed, lags), (butterworth, second)):
        f = passes(drive, t, arm, acc, False) if acc else f
        w = passes(drive, t - late, arm, gyr, True) if gyr else w
    if interval := device.get("interval", 0.0):
        f, w = incremented(drive, t, arm, interval)
    if "compliance" in device:
        f = on_a_mount(drive, t, arm, device["compliance"])
    f, w = f @ turn.T, w @ turn.T
    acc = f @ np.asarray(device.get("matrix_acc", np.eye(3))).T
    acc = acc + f**3 * device.get("cubic", np.zeros(3))
    gyr = w @ np.asarray(device.get("matrix_gyr", np.eye(3))).T
    gyr = gyr + f @ np.asarray(device.get("g", np.zeros((3, 3)))).T
    out = np.hstack([acc, gyr]) + device.get("bias", np.zeros(6))
    out = out + coloured(rng, n, 1 / hz, device.get("noise", {}))
    stamped = stamped + device.get("jitter", 0.0) * rng.standard_normal(n)
    return np.column_stack([stamped, out])
