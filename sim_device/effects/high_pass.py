"""The outputs go through a high-pass of first order.

    y_n = (y_(n-1) + x_n - x_(n-1)) exp(-r interval)

x outputs before it and y behind it; r, 1/s, one over the time constant, of the
accelerometers and of the gyroscopes. The first sample is as it was.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import Example, SimulatedEffect, Stage


class SimulatedHighPass(SimulatedEffect):
    """Corner of each triad, as one over its time constant."""

    VECTOR = ("acc", "gyr")
    EXAMPLE = Example({"acc": 2e-3})

    def stage(self, full_scale: Array) -> Stage:
        """Filtered, from the first sample on."""
        last: dict[int, tuple[float, float, float]] = {}

        def filtered(t: Array, x: Array) -> None:
            for row, rate in enumerate(np.repeat([self["acc"], self["gyr"]], 3)):
                if not rate:
                    continue
                begins = row not in last
                before, came, sent = last.get(
                    row, (float(t[0]), float(x[row, 0]), float(x[row, 0]))
                )
                interval = (t[-1] - before) / max(len(t) - begins, 1)
                kept = float(np.exp(-rate * interval))
                ended = float(x[row, -1])
                begin = kept * (sent - came) if not begins else (1 - kept) * came
                x[row], _ = lfilter([kept, -kept], [1, -kept], x[row], zi=[begin])
                last[row] = (float(t[-1]), ended, float(x[row, -1]))

        return filtered
