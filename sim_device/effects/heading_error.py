"""The base does not point north, which only the Earth's rate shows.

Positive: the base's z points west of north, so that the Earth's rate shows
+W cos(phi) sin(psi) on its x; W the Earth's rate, phi the latitude.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.sim_device.effect import Example, Number, SimulatedEffect
from fieldcal.sim_device.motion import Installation, Y
from fieldcal.sim_device.quaternion import multiply, turn


class SimulatedHeadingError(SimulatedEffect):
    """Rotation of the base about the vertical."""

    NUMBERS = {"psi_deg": Number()}
    NEEDS_EARTH = True
    EXAMPLE = Example(
        {"psi_deg": 12.0},
        device={
            "device": {"grade": "navigation"},
            "noise": {"gyr": [2e-5, 2e-5, 2e-5]},
        },
    )

    def change_installation(self, installation: Installation) -> Installation:
        """On a base that is turned about the vertical, however it is tilted."""
        yaw = turn(Y, np.array([-np.deg2rad(self["psi_deg"])]))
        return replace(installation, base=multiply(yaw, installation.base))
