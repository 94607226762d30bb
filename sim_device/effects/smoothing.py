"""A program smooths the outputs: each keeps a share of the previous one.

    y_n = y_(n-1) + (x_n - y_(n-1)) (1 - exp(-interval / tau))

x outputs of the device and y what is sent; tau of the accelerometers and of the
gyroscopes, s; 0: not smoothed.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import Example, SimulatedEffect, Stage, rows


class SimulatedSmoothing(SimulatedEffect):
    """Time constant of each triad."""

    VECTOR = ("acc", "gyr")
    ORDER = 1
    EXAMPLE = Example({"acc": 0.8, "gyr": 0.8})

    def stage(self, full_scale: Array) -> Stage:
        """Smoothed, from the first sample on."""
        last: dict[int, tuple[float, float]] = {}

        def smooth(t: Array, x: Array) -> None:
            for triad in self.VECTOR:
                if not (tau := self[triad]):
                    continue
                for row in rows(triad):
                    before, sent = last.get(row, (float(t[0]), float(x[row, 0])))
                    interval = (t[-1] - before) / max(len(t) - (row not in last), 1)
                    kept = float(np.exp(-interval / tau))
                    x[row], _ = lfilter(
                        [1 - kept], [1, -kept], x[row], zi=[kept * sent]
                    )
                    last[row] = (float(t[-1]), float(x[row, -1]))

        return smooth
