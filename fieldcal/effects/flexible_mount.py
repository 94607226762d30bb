"""The accelerometers sit on a structure that vibrates, and feel its first mode.

    U_i + b_i d2U_i/dt2 = f_i,    to first order  U_i += -b_i d2f_i/dt2

U output and f specific force, m/s^2, device axes; b = 1 / (2 pi F)^2, s^2, with the
mode's frequency F along i, Hz, well above those of the motion. Quick motion comes out
larger: by (hz / F)^2 at hz. A low-pass of the simulator's does nearly the same, late
besides. If negative, the simulator's structure vibrates. Seen only where a reference
follows the motion. Source: base excitation of one degree of freedom, e.g. S. Rao,
Mechanical Vibrations, 3.6; mounts of rubber 10 to 50 Hz, frames of drones 15 to 100 Hz.

>>> import numpy as np
>>> bend = np.array([[2.0, 0, 0]])
>>> x = Experience.at_rest(np.zeros(1), np.zeros(1), 9.8, f_bend=bend)
>>> FlexibleMount().design(x)[0, 0] + 0.0
array([-2.,  0.,  0.])
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.physics.effect import NO_SHAPE, Param, Sensor
from fieldcal.physics.experience import Experience


class FlexibleMount(Sensor):
    """Compliance of the structure below the accelerometers, by axis."""

    of_inputs = True
    params = tuple(Param(i, "s^2", 3e-4) for i in "xyz")
    while_moving = True
    covariate = "second derivative of the specific force"
    decided_by = "a quicker motion along each axis"
    cure = "Mount the device more stiffly, or give the simulator the mode of its mount."
    source = "one degree of freedom on a moving base; modes of 10 to 100 Hz"

    def applies(self, x: Experience) -> bool:
        """Where it is known how specific force changes."""
        return bool(x.f_bend.any())

    def design(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """Minus the second derivative, each axis by its own."""
        out = np.zeros((len(x), 6, 3))
        for i in range(3):
            out[:, i, i] = -x.f_bend[:, i]
        return out
