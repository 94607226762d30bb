"""Biases that settle toward other values from an instant on.

    U_i += A_i [1 - exp(-(t - t_0) / tau)],    W_i the same,    t >= t_0           (1)

t_0 = at_s, device time, s; A m/s^2 and rad/s. The sun comes out or goes, a heater or
another unit beside it is switched on: the device approaches another temperature, with
a time constant of its own. Seen without a thermometer, or beyond what it explains.
Source: first-order heating of a package, as for `warm_up`.

>>> import numpy as np
>>> x = Experience.at_rest(np.zeros(2), np.zeros(2), 9.8, t=np.array([50.0, 400.0]))
>>> shape = {"at_s": 100.0, "tau_s": 300.0}
>>> np.round(ThermalTransient().design(x, shape)[:, 0, 0], 4)
array([0.    , 0.6321])
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.physics.effect import BEYOND, NO_SHAPE, BiasChange, six
from fieldcal.physics.experience import Experience
from fieldcal.physics.shape import Shape


class ThermalTransient(BiasChange):
    """Exponential change of the biases from an instant on."""

    with_scales = True
    params = six("m/s^2", 5e-2, "rad/s", 2e-3)
    shapes = (
        Shape("at_s", "s", -np.inf, np.inf, "onset"),
        Shape("tau_s", "s", 30.0, 4000.0, "session", points=3),
    )
    covariate = "time"
    seen_in = "time"
    absent = "before it begins"
    decided_by = "a longer recording, until the change has died out"
    cure = (
        "Shade the device, or wait until it has the temperature of its use; take the "
        "positions after the instant again."
    )
    source = "first-order heating of a package, 100 to 2000 s"

    def chance(self, x: Experience) -> float:
        """Of three hundred sessions one; less where a thermometer shows a change.

        A device that warms up from the start, which is more frequent, resembles it.
        """
        return BEYOND if x.warms else 3e-3

    def course(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """The approach to the new value on every output, (1)."""
        since = np.maximum(x.t - shape["at_s"], 0.0)
        approach: Array = -np.expm1(-since / shape["tau_s"])
        return approach
