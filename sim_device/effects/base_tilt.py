"""The base is not level: tilted about its z, then about the turned x."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.sim_device.effect import Example, SimulatedEffect
from fieldcal.sim_device.motion import Installation, X, Z
from fieldcal.sim_device.quaternion import multiply, turn


class SimulatedBaseTilt(SimulatedEffect):
    """Tilt of the base."""

    VECTOR = ("about_x_deg", "about_z_deg")
    EXAMPLE = Example({"about_x_deg": 0.5, "about_z_deg": -0.7})

    def change_installation(self, installation: Installation) -> Installation:
        """On a base that is tilted, wherever it heads."""
        about_x, about_z = np.deg2rad(self.column(self.VECTOR))
        tilt = multiply(turn(Z, about_z), turn(X, about_x))
        return replace(installation, base=multiply(installation.base, tilt))
