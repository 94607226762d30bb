"""The sensors follow with a time constant: a low-pass of first order.

    U + tau_a dU/dt = f,    W + tau_g dW/dt = w

U, W outputs, f specific force and w angular rate, device axes; tau in s, of the
accelerometers and of the gyroscopes, and the bandwidth is 1 / (2 pi tau), Hz. By
tau the output is late as well, and only what goes as tau^2 tells it from a delay: the
quicker the motion, the better. If negative, the simulator has the low-pass. Seen where
a reference follows the motion, and in turns between known positions, which tell the
square of tau. Source: digital low-pass of the MPU-6000, register
map RM-MPU-6000A, CONFIG: 5 to 260 Hz.

>>> import numpy as np
>>> x = Experience.at_rest(np.zeros(1), np.zeros(1), 9.8, slope=np.full((1, 6), 3.0))
>>> Bandwidth().design(x)[0, [0, 5]] + 0.0
array([[-3.,  0.],
       [ 0., -3.]])
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.samples import ACC, GYR, Array
from fieldcal.physics.effect import NO_SHAPE, Param, Sensor, Values
from fieldcal.physics.experience import Experience
from fieldcal.physics.lag import Lag


class Bandwidth(Sensor):
    """Time constants of the accelerometers and of the gyroscopes."""

    of_inputs = True
    params = (Param("acc", "s", 0.03), Param("gyr", "s", 0.03))
    while_moving = True
    covariate = "how fast specific force and rate change"
    decided_by = "a quicker motion"
    cure = (
        "Give the simulator's sensors a low-pass of these time constants, or the"
        " device a filter with more bandwidth."
    )
    source = "register map RM-MPU-6000A: 5 to 260 Hz, 32 to 0.6 ms"

    def applies(self, x: Experience) -> bool:
        """Where it is known how specific force and rate change."""
        return bool(x.slope.any())

    def lag(self, values: Values) -> Lag:
        """The time constants of both triads."""
        return Lag(acc=float(values[0]), gyr=float(values[1]))

    def design(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """Minus the slope, each triad by its own."""
        out = np.zeros((len(x), 6, 2))
        out[:, ACC, 0], out[:, GYR, 1] = -x.slope[:, ACC], -x.slope[:, GYR]
        return out
