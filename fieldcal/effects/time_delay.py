"""The gyroscopes come late against the accelerometers.

    W(t) = w(t - d), to first order  W += -d dw/dt

W output and w angular rate, rad/s, device axes; d in s, positive when the gyroscopes
are late. Seen only while the device turns. Source: model of this project; filters and
buffers make 1 to 50 ms.

>>> import numpy as np
>>> x = Experience.at_rest(np.zeros(1), np.zeros(1), 9.8, w_dot=np.array([[0, 0, 3.0]]))
>>> TimeDelay().design(x)[0, 3:, 0] + 0.0
array([ 0.,  0., -3.])
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.physics.effect import NO_SHAPE, Param, Sensor, Values
from fieldcal.physics.experience import Experience
from fieldcal.physics.lag import Lag


class TimeDelay(Sensor):
    """Delay of the gyroscopes."""

    of_inputs = True
    params = (Param("seconds", "s", 0.05),)
    covariate = "angular acceleration in turns"
    decided_by = "faster turns"
    cure = "Correct the times in the driver by the delay that was found."
    source = "model of this project; 1 to 50 ms from filters and buffers"

    def lag(self, values: Values) -> Lag:
        """The delay of the gyroscopes."""
        return Lag(delay=float(values[0]))

    def design(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """Minus the angular acceleration."""
        out = np.zeros((len(x), 6, 1))
        out[:, 3:, 0] = -x.w_dot
        return out
