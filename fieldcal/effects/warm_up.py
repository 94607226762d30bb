"""Biases that settle after power-on.

    U_i += A_i exp(-t / tau),    W_i += A_i exp(-t / tau)

t, s, since the session's start; A m/s^2 and rad/s; tau 100 to 2000 s. Seen without a
thermometer, or beyond what it explains. Source: first-order warm-up of a package.

>>> import numpy as np
>>> x = Experience.at_rest(np.zeros(1), np.zeros(1), 9.8, since_start=np.array([300.0]))
>>> np.round(WarmUp().design(x, {"tau_s": 300.0})[0].diagonal(), 4)
array([0.3679, 0.3679, 0.3679, 0.3679, 0.3679, 0.3679])
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.physics.effect import BEYOND, CHANCE, NO_SHAPE, BiasChange, six
from fieldcal.physics.experience import Experience
from fieldcal.physics.shape import Shape


class WarmUp(BiasChange):
    """Exponential change of the biases since power-on."""

    with_scales = True
    params = six("m/s^2", 5e-2, "rad/s", 2e-3)
    shapes = (Shape("tau_s", "s", 30.0, 4000.0, "session"),)
    covariate = "time since the start"
    seen_in = "time"
    absent = "when warmed up"
    decided_by = "a longer recording, until the change has died out"
    cure = "Switch the device on earlier: three times tau_s before the first window."
    source = "first-order warm-up of a package, 100 to 2000 s"

    def chance(self, x: Experience) -> float:
        """Less where a thermometer shows what changes anyway."""
        return BEYOND if x.warms else CHANCE

    def course(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """The exponential on every output."""
        decay: Array = np.exp(-x.since_start / shape["tau_s"])
        return decay
