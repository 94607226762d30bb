"""Outputs are increments over an interval, in the axes at one of its ends.

    U += s w x f,    W += c w x dw/dt

U, W outputs, f specific force and w angular rate, device axes. Velocity increments over
an interval T in the axes at its start have s = T / 2, and in those at its end -T / 2,
s; rotation vectors over T, into which coning is integrated, have c = T^2 / 12, s^2.
Without it the output is the mean over the interval in the axes of each moment. With
the other sign, the simulator's are such. Seen only where a reference follows the
motion. Source: J. Bortz, A New Mathematical Formulation for Strapdown Inertial
Navigation, 1971; P. Savage, Strapdown Inertial Navigation Integration Algorithm Design,
1998.

>>> import numpy as np
>>> x = Experience.at_rest(
...     np.zeros(1), np.zeros(1), 9.8, rate=np.array([[0, 0, 2.0]]),
...     w_dot=np.array([[3.0, 0, 0]]),
... )
>>> Increments().design(x)[0, [0, 4]] + 0.0
array([[19.6,  0. ],
       [ 0. ,  6. ]])
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.samples import ACC, GYR, Array
from fieldcal.physics.effect import NO_SHAPE, Param, Sensor
from fieldcal.physics.experience import Experience


class Increments(Sensor):
    """Sculling and coning terms of increments, which means do not have."""

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
        """Rate across force, and across its own change."""
        out = np.zeros((len(x), 6, 2))
        out[:, ACC, 0], out[:, GYR, 1] = np.cross(x.w, x.f), np.cross(x.w, x.w_dot)
        return out
