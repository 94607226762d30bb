"""What lasts is taken out of the outputs: a high-pass of first order.

    U' = u' - U / tau,    U = u - (1 / tau) (integral of U since the start)          (1)

u output without it and U with it, device axes; 1 / tau in 1/s, one of a sensor's three
outputs. The second form is the first one integrated, and holds for any tau: what is
recorded is U itself, and what it was before the start is a constant that counts as
bias. So a bias means nothing once such a device has moved on: it follows what was
measured. As U is of the outputs, it needs no scale factor to be known. Source: a
setting of accelerometers for tilt that changes or for shocks; the driver of the ADXL355
in Zephyr lists corners of 24.7e-4 to 0.0238e-4 times the output rate, which is 0.5 to
2100 s at 31 to 125 Hz.

>>> import numpy as np
>>> x = Experience.at_rest(np.zeros(1), np.zeros(1), 9.8, passed=np.full((1, 6), 3.0))
>>> HighPass().design(x)[0].T + 0.0
array([[-3., -3., -3.,  0.,  0.,  0.],
       [ 0.,  0.,  0., -3., -3., -3.]])
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.samples import ACC, GYR, Array
from fieldcal.physics.effect import NO_SHAPE, Param, Sensor
from fieldcal.physics.experience import Experience


class HighPass(Sensor):
    """Corners of the accelerometers and of the gyroscopes, as 1 / tau."""

    params = (Param("acc", "1/s", 1e-3), Param("gyr", "1/s", 1e-3))
    covariate = "integral of the output"
    seen_in = "time"
    absent = "at the start"
    decided_by = "one position for longer: what decays is not there"
    cure = (
        "Switch the high-pass filter of the sensors off, and record again: behind it"
        " neither a bias nor a position lasts."
    )
    ruins = (
        "the outputs forget what lasts: a high-pass filter is in them, and biases"
        " behind it follow what was measured before; switch it off, and record again"
    )
    source = (
        "driver of the ADXL355 in Zephyr: corners of 2.38e-6 to 2.47e-3 of the rate"
    )

    def applies(self, x: Experience) -> bool:
        """Where the outputs were recorded, in more than one position.

        In one it is like a drift of the biases, which every device has.
        """
        return bool(x.passed.any() and len(np.unique(x.position[x.position >= 0])) > 1)

    def acts_on(self, x: Experience) -> bool:
        """On all rows, also those of one position and of turns."""
        return bool(x.passed.any())

    def chance(self, x: Experience) -> float:
        """A setting that nobody wants for calibration: one in a thousand."""
        return 1e-3

    def design(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """Minus the integral of each output, by the corner of its sensor."""
        out = np.zeros((len(x), 6, 2))
        out[:, ACC, 0], out[:, GYR, 1] = -x.passed[:, ACC], -x.passed[:, GYR]  # (1)
        return out
