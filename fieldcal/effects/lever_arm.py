"""The accelerometers are not where the device turns: they feel the turn.

    f += w x (w x r) + dw/dt x r

f specific force, m/s^2; w angular rate, rad/s; r, m, from the axis of the turn to the
accelerometers, all in device axes. Seen only while the device turns. Source: rigid
body kinematics.

>>> import numpy as np
>>> x = Experience.at_rest(np.zeros(1), np.zeros(1), 0.0, rate=np.array([[0, 0, 2.0]]))
>>> LeverArm().change(x, [0.5, 0.0, 0.0]).f + 0.0  # towards the axis: -w^2 r
array([[-2.,  0.,  0.]])
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.physics.effect import Motion, Param, Values
from fieldcal.physics.experience import Experience


class LeverArm(Motion):
    """Vector from the axis of the turn to the accelerometers."""

    params = tuple(Param(i, "m", 0.3) for i in "xyz")
    covariate = "rate squared and angular acceleration in turns"
    decided_by = "faster turns about each axis"
    cure = "Mount the device nearer to the axes of the turns, or turn slowly."
    source = "rigid body kinematics; 0.01 to 0.3 m on a fixture"
    order = 9
    on_the_way = True

    def change(self, x: Experience, values: Values) -> Experience:
        """Add the centripetal and the tangential acceleration."""
        r = np.asarray(values, float)
        return replace(
            x, f=x.f + np.cross(x.w, np.cross(x.w, r)) + np.cross(x.w_dot, r)
        )
