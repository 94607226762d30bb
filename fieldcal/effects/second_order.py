"""The sensors follow as a low-pass of second order does.

    U + sqrt(2) tau_a dU/dt + tau_a^2 d2U/dt2 = f,    the same of W with tau_g and w

U, W outputs, f specific force and w angular rate, device axes; tau in s, of the
accelerometers and of the gyroscopes. This is the Butterworth low-pass, and 1 / (2 pi
tau) its cut-off, Hz. By sqrt(2) tau the output is late as well, and only what goes as
tau^3 tells it from a delay. One that is damped otherwise goes as this and `bandwidth`
together. If negative, the simulator has the low-pass. Seen only where a reference
follows the motion. Source: ArduPilot, LowPassFilter2p, INS_GYRO_FILTER 20 Hz and
INS_ACCEL_FILTER 10 to 20 Hz; S. Butterworth 1930.

>>> import numpy as np
>>> x = Experience.at_rest(np.zeros(1), np.zeros(1), 9.8, bend=np.full((1, 6), 3.0))
>>> SecondOrder().design(x)[0, [0, 5]] + 0.0
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


class SecondOrder(Sensor):
    """Time constants of Butterworth low-passes of both triads."""

    of_inputs = True
    params = (Param("acc", "s", 0.03), Param("gyr", "s", 0.03))
    while_moving = True
    covariate = "how fast specific force and rate change"
    decided_by = "a quicker motion"
    cure = (
        "Give the simulator's sensors a Butterworth low-pass of second order with these"
        " time constants, or the device a filter with a higher cut-off."
    )
    source = "ArduPilot, LowPassFilter2p: 5 to 100 Hz, 32 to 1.6 ms"

    def applies(self, x: Experience) -> bool:
        """Where it is known how specific force and rate change."""
        return bool(x.bend.any())

    def lag(self, values: Values) -> Lag:
        """The time constants of both triads."""
        return Lag(acc_second=float(values[0]), gyr_second=float(values[1]))

    def design(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """Minus the bend, each triad by its own."""
        out = np.zeros((len(x), 6, 2))
        out[:, ACC, 0], out[:, GYR, 1] = -x.bend[:, ACC], -x.bend[:, GYR]
        return out
