"""A line in the outputs: mains, an engine, a fan, or an alias of one of them.

    U_i += A_i cos(2 pi hz t + phi_i),    W_i += A_i cos(2 pi hz t + phi_i)

A m/s^2 and rad/s, hz the frequency as it appears in the samples. Source: narrow-band
interference; any frequency up to half the sampling rate.

>>> import numpy as np
>>> x = Experience.at_rest(np.zeros(1), np.zeros(1), 9.8)
>>> bool((Hum().response(x, 50.0)[0] == np.eye(6)).all())
True
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldcal.physics.effect import Line, six
from fieldcal.physics.experience import Experience
from fieldcal.physics.shape import Shape


class Hum(Line):
    """A line in each output."""

    kind = "sensor"
    params = six("m/s^2", 0.1, "rad/s", 1e-2)
    shapes = (Shape("hz", "Hz"),)
    covariate = "spectrum"
    decided_by = "the same window with the suspected source switched off"
    cure = "Find the source by its frequency, and keep cables and engines away."
    source = "narrow-band interference; any frequency up to half the sampling rate"
    band = (0.05, np.inf)

    def response(self, x: Experience, hz: float) -> NDArray[np.complexfloating]:
        """Each output on its own."""
        return np.broadcast_to(np.eye(6, dtype=complex), (len(x), 6, 6))
