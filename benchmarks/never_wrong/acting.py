"""What acts on a device, or happens in it, beside what positions and turns do.

Written apart from everything that estimates. Device axes, m/s^2 and rad/s:

    f += (dw/dt) x r + w x (w x r)             a lever arm r to the axes of the fixture
    f += a sin(2 pi h t) e                     vibration of the bench along e
    U(t) = integral of e^(-s/T) U(t - s) ds/T  a filter of the first order, in both
    W(t) = W(t - d)                            a delay of the gyroscopes
    U += s sign(f - f_before)                  what stays of the last turn
    U += q, W += r                             biases that wander by a random walk
    U += c e^(-t/T), W += d e^(-t/T)           a device that warms up

Sway turns the base about its level axis by a sine, a kick by an angle that stays, and
soft ground gives way by an angle that ends in e^(-t/T). In a mount that is loose the
device slips by an angle about an axis of its own, which stays. Vibration and sway may
act in some spans of time alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

KICK_S = 0.3
"""How long a kick takes, and what begins or ends to act, s."""


@dataclass(frozen=True)
class Acting:
    """Sizes of all that; 0 for what there is not.

    Attributes
    ----------
    arm : m, along each axis of the device
    shaken, hum_hz : amplitude, m/s^2, and frequency of a vibration
    swaying, sway_hz : amplitude, rad, and frequency of the base
    spans : start and end, s, of when these two act; always, where there is none
    filtered, delayed : s
    stays : m/s^2, what the last turn leaves
    acc_walk, gyr_walk : what biases wander by in 100 s
    acc_cold, gyr_cold, warming : what biases are off by at first, and T, s
    kicked, kick_s : rad by which the base is turned for good, and when
    sinking, sinks_s : rad by which soft ground gives way at last, and T, s
    slips, slip_s : rad about each axis by which the device slips, and when

    """

    arm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    shaken: float = 0.0
    hum_hz: float = 0.0
    swaying: float = 0.0
    sway_hz: float = 0.0
    spans: tuple[tuple[float, float], ...] = ()
    filtered: float = 0.0
    delayed: float = 0.0
    stays: float = 0.0
    acc_walk: float = 0.0
    gyr_walk: float = 0.0
    acc_cold: float = 0.0
    gyr_cold: float = 0.0
    warming: float = 1.0
    kicked: float = 0.0
    kick_s: float = 0.0
    sinking: float = 0.0
    sinks_s: float = 1.0
    slips: tuple[float, float, float] = (0.0, 0.0, 0.0)
    slip_s: float = 0.0

    def tilted(self, t: Floats) -> tuple[Floats, Floats]:
        """Tilt of a base that sways, is kicked or sinks, rad; its rate, rad/s, (n,)."""
        phase = 2 * np.pi * self.sway_hz * t
        here, coming = self._acts(t)
        sway = self.swaying * np.sin(phase)
        rate = 2 * np.pi * self.sway_hz * self.swaying * np.cos(phase)
        kick, kicking = _step(t, self.kick_s)
        left = np.exp(-t / self.sinks_s)
        turned = here * sway + self.kicked * kick + self.sinking * (1 - left)
        rate = here * rate + coming * sway + self.kicked * kicking
        return turned, rate + self.sinking / self.sinks_s * left

    def slid(self, t: Floats, f: Floats, w: Floats) -> tuple[Floats, Floats]:
        """Force and rate as a device that slips has them, (n, 3) each."""
        size = float(np.linalg.norm(self.slips))
        if not size:
            return f, w
        axis = np.array(self.slips) / size
        share, speed = _step(t, self.slip_s)
        f, w = (_turned_by(-size * share, axis, v) for v in (f, w))
        return f, w + size * speed[:, None] * axis

    @property
    def askew(self) -> Floats | None:
        """How a device that slipped before the recording is turned, (3, 3)."""
        size = float(np.linalg.norm(self.slips))
        if not size or self.slip_s >= 0:
            return None
        return _turned_by(np.full(3, -size), np.array(self.slips) / size, np.eye(3)).T

    def _acts(self, t: Floats) -> tuple[Floats, Floats]:
        """How much vibration and sway act, 0 to 1, and its rate, 1/s, (n,) each."""
        if not self.spans:
            return np.ones_like(t), np.zeros_like(t)
        here, coming = np.zeros((2, len(t)))
        for ends in self.spans:
            for sign, at in zip((1, -1), ends, strict=True):
                value, rate = _step(t, at)
                here, coming = here + sign * value, coming + sign * rate
        return here, coming

    def felt(self, t: Floats, f: Floats, w: Floats) -> Floats:
        """The force where the accelerometers are, (n, 3)."""
        arm = np.array(self.arm)
        out: Floats = f + np.cross(np.gradient(w, t, axis=0), arm)
        out += np.cross(w, np.cross(w, arm))
        hum = self.shaken * np.sin(2 * np.pi * self.hum_hz * t) * self._acts(t)[0]
        out += hum[:, None] * np.array([0.6, 0.0, 0.8])
        return out

    def passed(self, t: Floats, acc: Floats, gyr: Floats) -> tuple[Floats, Floats]:
        """Outputs as filter and delay let them through, (n, 3) each."""
        if self.filtered:
            acc, gyr = (_filtered(u, t, self.filtered) for u in (acc, gyr))
        late = t - self.delayed
        gyr = np.column_stack([np.interp(late, t, c) for c in gyr.T])
        return acc, gyr

    def wanders(
        self, t: Floats, f: Floats, windows: Floats, rng: np.random.Generator
    ) -> tuple[Floats, Floats]:
        """What biases are off by, (n, 3) each; nothing at the end."""
        step = np.sqrt((t[1] - t[0]) / 100.0)
        warm = np.exp(-t / self.warming)[:, None] * np.array([1.0, -0.7, 0.4])
        walks = []
        for size, cold in (
            (self.acc_walk, self.acc_cold), (self.gyr_walk, self.gyr_cold),
        ):  # fmt: skip
            walk = np.cumsum(rng.normal(0, size * step, (len(t), 3)), axis=0)
            walk += cold * warm
            walks.append(walk - walk[t <= windows[-1, 1]][-1])
        acc, gyr = walks
        left, last = np.zeros(3), None
        for start, end in windows:
            here = f[(t >= start) & (t <= end)].mean(axis=0)
            if last is not None:
                now = self.stays * np.sign(here - last)
                acc[t >= start] += now - left
                left = now
            last = here
        return acc, gyr


def _step(t: Floats, at: float) -> tuple[Floats, Floats]:
    """From 0 to 1 within `KICK_S` of an instant, s, and its rate, 1/s, (n,) each."""
    part = np.clip((t - at) / KICK_S, 0.0, 1.0)
    value = part - np.sin(2 * np.pi * part) / (2 * np.pi)
    return value, (1 - np.cos(2 * np.pi * part)) / KICK_S


def _turned_by(angle: Floats, axis: Floats, vectors: Floats) -> Floats:
    """Vectors turned by angles (n,) about an axis, by Rodrigues' formula, (n, 3)."""
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    along = (vectors @ axis)[:, None] * axis
    out: Floats = cos * vectors + sin * np.cross(axis, vectors) + (1 - cos) * along
    return out


def _filtered(values: Floats, t: Floats, constant: float) -> Floats:
    """Behind a filter of the first order, (n, 3)."""
    keep = float(np.exp(-(t[1] - t[0]) / constant))
    out = values.copy()
    for i in range(1, len(out)):
        out[i] = keep * out[i - 1] + (1 - keep) * values[i]
    return out
