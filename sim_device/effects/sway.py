"""The base sways on and on about a level axis.

    x(t) = A sin(2 pi h t + p)                                      (1)

x angle, rad; the axis lies `azimuth` from East towards north.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import ABOVE_ZERO, Example, Number, SimulatedEffect
from fieldcal.sim_device.motion import Angle, BaseMotion, level_axis


class SimulatedSway(SimulatedEffect):
    """The swaying of the base."""

    NUMBERS = {
        "amplitude_deg": Number(),
        "hz": Number(range=ABOVE_ZERO),
        "phase_deg": Number(0.0),
        "azimuth_deg": Number(45.0),
    }
    REPEATS = True
    EXAMPLE = Example({"amplitude_deg": 0.05, "hz": 0.6})

    def base_motion(self) -> BaseMotion:
        """The swaying of the base, for ever."""
        return BaseMotion(level_axis(np.deg2rad(self["azimuth_deg"])), self._angle)

    def _angle(self, t: Array) -> Angle:
        amplitude, pulse = np.deg2rad(self["amplitude_deg"]), 2 * np.pi * self["hz"]
        phase = pulse * t + np.deg2rad(self["phase_deg"])
        x = amplitude * np.sin(phase)  # (1)
        return Angle(x, amplitude * pulse * np.cos(phase), -(pulse**2) * x)
