"""The outputs are rounded to a least significant bit, m/s^2 and rad/s; 0: to none."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import Example, SimulatedEffect, Stage, rows


class SimulatedQuantisation(SimulatedEffect):
    """Least significant bit of each triad."""

    VECTOR = ("acc", "gyr")
    ORDER = 2
    EXAMPLE = Example(
        {"acc": 0.03, "gyr": 1.5e-3},
        unmended="rounding widens the intervals and shifts nothing",
    )

    def stage(self, full_scale: Array) -> Stage:
        """Rounded to the nearest step."""

        def rounded(t: Array, x: Array) -> None:
            for channel in self.VECTOR:
                if lsb := self[channel]:
                    x[rows(channel)] = np.rint(x[rows(channel)] / lsb) * lsb

        return rounded
