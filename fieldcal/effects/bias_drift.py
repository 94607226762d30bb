"""Biases that drift steadily.

    U_i += d_i t,    W_i += d_i t

t, s, since the session's start; d m/s^2/s and rad/s/s. Source: IEEE Std 952, rate ramp.

>>> import numpy as np
>>> x = Experience.at_rest(np.zeros(1), np.zeros(1), 9.8, since_start=np.array([60.0]))
>>> BiasDrift().design(x)[0].diagonal()
array([60., 60., 60., 60., 60., 60.])
"""

from __future__ import annotations

from collections.abc import Mapping

from fieldcal.core.samples import Array
from fieldcal.physics.effect import BEYOND, CHANCE, NO_SHAPE, BiasChange, six
from fieldcal.physics.experience import Experience


class BiasDrift(BiasChange):
    """Linear change of the biases."""

    with_scales = True
    params = six("m/s^2/s", 1e-4, "rad/s/s", 5e-6)
    covariate = "time"
    seen_in = "time"
    absent = "at the start"
    decided_by = "the first position once more at the end"
    cure = (
        "Take the first position again at the end, so that the drift can be "
        "estimated; calibrate shortly before use."
    )
    source = "IEEE Std 952, rate ramp"

    def chance(self, x: Experience) -> float:
        """Less where a thermometer shows what changes anyway."""
        return BEYOND if x.warms else CHANCE

    def course(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """Time on every output."""
        return x.since_start
