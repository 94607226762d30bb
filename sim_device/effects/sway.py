"""The base sways on and on about a level axis.

    x(t) = A / sqrt(n) sum_k sin(2 pi h_k t + p_k)                  (1)

x angle, rad; the axis lies `azimuth` from East towards north. A regular sway is one
wave of frequency h and phase p. A spread makes it as irregular as wind and waves are:
then h_k are quantiles of a normal distribution about h, phases p_k without any order.
"""

from __future__ import annotations

from statistics import NormalDist

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import (
    ABOVE_ZERO,
    NOT_NEGATIVE,
    Example,
    Number,
    SimulatedEffect,
)
from fieldcal.sim_device.motion import Angle, BaseMotion, level_axis

WAVES = 40
"""Of an irregular sway."""

LOWEST = 0.2
"""Part of the mean frequency below which no wave is."""

GOLDEN = (1 + 5**0.5) / 2


class SimulatedSway(SimulatedEffect):
    """Oscillation of the base."""

    NUMBERS = {
        "amplitude_deg": Number(),
        "hz": Number(range=ABOVE_ZERO),
        "phase_deg": Number(0.0),
        "azimuth_deg": Number(45.0),
        "spread_hz": Number(0.0, NOT_NEGATIVE),
    }
    REPEATS = True
    EXAMPLE = Example({"amplitude_deg": 0.05, "hz": 0.6})

    def base_motion(self) -> BaseMotion:
        """The swaying of the base, for ever."""
        return BaseMotion(level_axis(np.deg2rad(self["azimuth_deg"])), self._angle)

    def _angle(self, t: Array) -> Angle:
        pulse, begins = self._waves
        size = np.deg2rad(self["amplitude_deg"]) / np.sqrt(len(pulse))
        phase = np.multiply.outer(t, pulse) + begins
        x = size * np.sin(phase).sum(axis=1)  # (1)
        rate = size * np.cos(phase) @ pulse
        return Angle(x, rate, -size * np.sin(phase) @ pulse**2)

    @property
    def _waves(self) -> tuple[Array, Array]:
        """Frequencies, rad/s, and phases, rad, of all waves."""
        mean, spread, phase = (self[n] for n in ("hz", "spread_hz", "phase_deg"))
        if not spread:
            return np.array([2 * np.pi * mean]), np.deg2rad([phase])
        k = np.arange(WAVES)
        normal = NormalDist(mean, spread)
        hz = np.array([normal.inv_cdf((i + 0.5) / WAVES) for i in k])
        hz = np.maximum(hz, LOWEST * mean)
        return 2 * np.pi * hz, np.deg2rad(phase) * (1 + k) + 2 * np.pi * GOLDEN * k**2
