"""Biases that jump at an instant.

    U_i += s_i (t >= t_0),    W_i += s_i (t >= t_0)

t_0 = at_s, device time, s; s m/s^2 and rad/s. A mean over the instant has its part.
Source: stress released, a supply switched, a range changed.

>>> import numpy as np
>>> x = Experience.at_rest(np.zeros(2), np.zeros(2), 9.8, t=np.array([9.0, 11.0]))
>>> BiasStep().design(x, {"at_s": 10.0})[:, 0, 0]
array([0., 1.])
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.physics.effect import NO_SHAPE, BiasChange, six
from fieldcal.physics.experience import Experience
from fieldcal.physics.shape import Shape
from fieldcal.physics.step import step_course


class BiasStep(BiasChange):
    """Jump of the biases."""

    params = six("m/s^2", 5e-2, "rad/s", 2e-3)
    shapes = (Shape("at_s", "s", -np.inf, np.inf, "instant"),)
    with_scales = True
    event = "other calibration"
    covariate = "time"
    seen_in = "time"
    absent = "before the step"
    decided_by = "the position before the jump once more"
    cure = (
        "Look for what happened at that instant (supply, range, a knock), and "
        "take the positions before it again."
    )
    source = "stress released, a supply switched, a range changed"

    def course(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """One from the instant on, on every output."""
        return step_course(x, shape["at_s"])
