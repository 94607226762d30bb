"""Biases that differ between heating and cooling.

    U_i += h_i dT/dt,    W_i += h_i dT/dt

dT/dt, K/s, is the rate of the temperature; h m/s^2/(K/s) and rad/s/(K/s). Source:
first-order lag of the sensor behind the thermometer, h = -coefficient x lag.

>>> import numpy as np
>>> x = Experience.at_rest(np.zeros(1), np.zeros(1), 9.8, heating=np.array([0.01]))
>>> ThermalHysteresis().design(x)[0].diagonal()
array([0.01, 0.01, 0.01, 0.01, 0.01, 0.01])
"""

from __future__ import annotations

from collections.abc import Mapping

from fieldcal.core.samples import Array
from fieldcal.physics.effect import BEYOND, NO_SHAPE, BiasChange, six
from fieldcal.physics.experience import Experience


class ThermalHysteresis(BiasChange):
    """Response of the biases to the rate of the temperature."""

    with_scales = True
    params = six("m/s^2/(K/s)", 1.0, "rad/s/(K/s)", 2e-2)
    covariate = "rate of the temperature"
    seen_in = "temperature"
    decided_by = "the same temperature once heating and once cooling"
    cure = (
        "Change the temperature slowly, and calibrate in the direction in which "
        "the device is used."
    )
    source = "first-order lag of 10 to 100 s with the temperature_bias sizes"

    def applies(self, x: Experience) -> bool:
        """Where a thermometer shows a change."""
        return x.warms

    def chance(self, x: Experience) -> float:
        """It comes on top of what the temperature itself does."""
        return BEYOND

    def course(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """Rate of the temperature on every output."""
        return x.heating
