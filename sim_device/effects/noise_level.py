"""Outputs are noisier than their noise figures say, by a ratio."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import (
    ABOVE_ZERO,
    CHANNEL,
    Example,
    Number,
    SimulatedEffect,
    rows,
)


class SimulatedNoiseLevel(SimulatedEffect):
    """Ratio of the noise of some outputs to their noise figures."""

    NUMBERS = {"ratio": Number(range=ABOVE_ZERO)}
    WORDS = {"channel": CHANNEL}
    REPEATS = True
    EXAMPLE = Example(
        {"channel": "az", "ratio": 3.0},
        unmended="louder noise widens the intervals and shifts nothing",
    )

    def noise_ratio(self) -> Array:
        """The ratio where it is louder."""
        ratio = np.ones(6)
        ratio[rows(self.words["channel"])] = self["ratio"]
        return ratio
