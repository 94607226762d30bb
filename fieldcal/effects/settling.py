"""Biases that settle after each turn.

    U_i += A_i exp(-t / tau),    W_i += A_i exp(-t / tau)

t, s, since the device was last turned; A m/s^2 and rad/s; tau 1 to 30 s. Source:
relaxation of suspension, adhesive and fixture after a change of load.

>>> import numpy as np
>>> x = Experience.at_rest(np.zeros(1), np.zeros(1), 9.8, since_turn=np.array([4.0]))
>>> np.round(Settling().design(x, {"tau_s": 4.0})[0].diagonal(), 4)
array([0.3679, 0.3679, 0.3679, 0.3679, 0.3679, 0.3679])
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.physics.effect import NO_SHAPE, BiasChange, six
from fieldcal.physics.experience import Experience
from fieldcal.physics.shape import Shape


class Settling(BiasChange):
    """Exponential change of the biases since the last turn."""

    params = six("m/s^2", 3e-2, "rad/s", 1e-3)
    shapes = (Shape("tau_s", "s", 0.7, 40.0, "turn"),)
    covariate = "time since the turn"
    seen_in = "transient"
    decided_by = "a longer wait between the turn and the window"
    cure = "Wait longer after each turn before the window begins."
    source = "relaxation after a change of load; 1e-4 to 1e-2 m/s^2, 1 to 30 s"

    def course(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """The exponential on every output."""
        decay: Array = np.exp(-x.since_turn / shape["tau_s"])
        return decay
