"""Stamps that are off where samples are taken evenly: jitter, or a coarse clock.

    U(t) = f(t - q e),    W(t) = w(t - q e),    to first order  -q e df/dt, -q e dw/dt

U, W outputs with the stamp t, f specific force and w angular rate, device axes; e, s,
by how much the stamp is off the even times of its stretch; q the share of that which is
the stamp's error: 1 where samples are even, 0 where they were taken when the stamps
say. A clock of coarse steps d makes errors of d / sqrt(12), and arrival by a host's
clock those of the link. Where samples are taken unevenly and stamped evenly, nobody
knows e: that is noise. Seen only where a reference follows the motion. Source: model of
this project; steps of 1 ms of autopilots' logs, 1 to 20 ms of serial links.

>>> import numpy as np
>>> x = Experience.at_rest(np.zeros(1), np.zeros(1), 9.8, missed=np.full((1, 6), 0.2))
>>> StampError().design(x)[0, :, 0]
array([-0.2, -0.2, -0.2, -0.2, -0.2, -0.2])
"""

from __future__ import annotations

from collections.abc import Mapping

from fieldcal.core.samples import Array
from fieldcal.physics.effect import NO_SHAPE, Param, Sensor, Values
from fieldcal.physics.experience import Experience
from fieldcal.physics.lag import Lag


class StampError(Sensor):
    """Share of the stamps' unevenness that is their error."""

    of_inputs = True
    params = (Param("share", "1", 1.0),)
    while_moving = True
    covariate = "how fast specific force and rate change, times what stamps are off by"
    decided_by = "a quicker motion"
    cure = "Give the samples even times: a line through the stamps of each stretch."
    source = "model of this project; clocks of 1 ms, links of 1 to 20 ms"

    def applies(self, x: Experience) -> bool:
        """Where stamps are uneven and it is known how force and rate change."""
        return bool(x.missed.any())

    def lag(self, values: Values) -> Lag:
        """The share that is the stamps'."""
        return Lag(stamps=float(values[0]))

    def design(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """Minus the change in the time that the stamps are off by."""
        out: Array = -x.missed[:, :, None]
        return out
