"""The accelerometers are not where the device turns: they feel the turn.

    f += dw cross r + w cross (w cross r)                 ((m4) of `motion`)

r, m, from the turning centre to the sensors, device axes.
"""

from __future__ import annotations

from dataclasses import replace

from fieldcal.sim_device.effect import AXES, Example, SimulatedEffect
from fieldcal.sim_device.motion import Installation


class SimulatedLeverArm(SimulatedEffect):
    """Vector from the centre of rotation to the sensors, m."""

    VECTOR = AXES
    EXAMPLE = Example({"x": 0.2, "y": -0.15, "z": 0.1})

    def change_installation(self, installation: Installation) -> Installation:
        """Off the turning centre."""
        return replace(installation, lever=self.column(AXES))
