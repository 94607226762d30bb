"""Biases that follow the temperature.

    U_i += c_i dT,    W_i += c_i dT

dT, K, is the temperature less that at the session's start; c m/s^2/K and rad/s/K.
Source: IEEE Std 1293 and 1431, bias temperature sensitivity.

>>> import numpy as np
>>> x = Experience.at_rest(np.zeros(1), np.zeros(1), 9.8, warming=np.array([3.0]))
>>> TemperatureBias().design(x)[0].diagonal()
array([3., 3., 3., 3., 3., 3.])
"""

from __future__ import annotations

from collections.abc import Mapping

from fieldcal.core.samples import Array
from fieldcal.physics.effect import NO_SHAPE, BiasChange, six
from fieldcal.physics.experience import Experience


class TemperatureBias(BiasChange):
    """Temperature coefficient of the biases."""

    with_scales = True
    params = six("m/s^2/K", 1.5e-2, "rad/s/K", 5e-4)
    covariate = "temperature"
    seen_in = "temperature"
    absent = "at the start's temperature"
    decided_by = "the same position again at another temperature"
    cure = (
        "Wait until the temperature stands still, or record while it changes "
        "and apply the coefficients."
    )
    source = "IEEE Std 1293, 1431; 1e-4 to 1.5e-2 m/s^2/K, 1e-5 to 5e-4 rad/s/K"

    def applies(self, x: Experience) -> bool:
        """Where a thermometer shows a change."""
        return x.warms

    def course(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """Temperature on every output."""
        return x.warming
