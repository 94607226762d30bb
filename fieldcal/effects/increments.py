"""Outputs are increments over an interval, in the axes at one of its ends.

    U += s w x f + c (f''/2 + w x f' - w' x f + 2 w x (w x f))
    W += c (w''/2 + w x w')

U, W outputs, f specific force and w angular rate in the middle of the interval, device
axes; w', f'' and the like derivatives of their components. Over an interval T velocity
increments in the axes at its start have s = T / 2, and those in the axes at its end
-T / 2, s; c = T^2 / 12, s^2, is in the mean over T and in the rotation vector, into
which coning is integrated. Where it is the reference that has increments, both signs
are reversed, and the last of the terms, solved for f, is -w x (w x f).
Seen only where a reference follows the motion. The equations are the expansion of

    U = 1/T int R f dt,    W = 1/T (int w dt + 1/2 int (int w dt) x w dt)

to the square of T. Source: J. Bortz, A New Mathematical Formulation for Strapdown
Inertial Navigation, 1971; P. Savage, Strapdown Inertial Navigation Integration
Algorithm Design, 1998.

>>> import numpy as np
>>> x = Experience.at_rest(
...     np.zeros(1), np.zeros(1), 9.8, rate=np.array([[0, 0, 2.0]]),
...     w_dot=np.array([[3.0, 0, 0]]),
... )
>>> Increments().design(x)[0, [0, 1, 4]] + 0.0
array([[19.6,  0. ],
       [ 0. , 78.4],
       [ 0. ,  6. ]])
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.samples import ACC, GYR, Array
from fieldcal.physics.effect import NO_SHAPE, Param, Sensor
from fieldcal.physics.experience import Experience


class Increments(Sensor):
    """What increments have that the motion at an instant has not."""

    of_inputs = True
    params = (Param("sculling", "s", 0.01), Param("coning", "s^2", 1e-4))
    while_moving = True
    covariate = "rate across specific force, and rate across angular acceleration"
    decided_by = "a quicker motion about two axes at once"
    cure = (
        "Have the simulator put out increments over the device's interval, or turn the"
        " device's into the axes in the middle of it."
    )
    source = "Bortz 1971, Savage 1998; intervals of 2 to 40 ms"

    def applies(self, x: Experience) -> bool:
        """Where a reference follows the motion."""
        return bool(x.slope.any())

    def design(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """Rate across force, and what goes as the square of the interval."""
        out, across = np.zeros((len(x), 6, 2)), np.cross(x.w, x.f)
        square = x.f_bend / 2 + np.cross(x.w, x.f_dot) - np.cross(x.w_dot, x.f)
        out[:, ACC, 0], out[:, ACC, 1] = across, square + 2 * np.cross(x.w, across)
        out[:, GYR, 1] = x.w_bend / 2 + np.cross(x.w, x.w_dot)
        return out

    def change_of_outputs(
        self, x: Experience, values: Array, shape: Mapping[str, float] = NO_SHAPE
    ) -> Array:
        """Change of the outputs; of increments that the reference has, solved for f."""
        out = super().change_of_outputs(x, values, shape)
        if values[1] < 0:
            out[:, ACC] -= 3 * values[1] * np.cross(x.w, np.cross(x.w, x.f))
        return out
