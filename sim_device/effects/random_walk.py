"""The biases wander without bound: a random walk, by its density per sqrt(s)."""

from __future__ import annotations

import numpy as np

from fieldcal.sim_device.effect import SIX, Example, SimulatedEffect
from fieldcal.sim_device.random_process import Walk


class SimulatedRandomWalk(SimulatedEffect):
    """Random walk of each bias."""

    VECTOR = SIX
    EXAMPLE = Example({"ax": 8e-4, "ay": 8e-4, "az": 8e-4})

    def random_bias(self, rate: float, rng: np.random.Generator) -> Walk:
        """Random walk of each bias."""
        return Walk(self.column(SIX)[:, 0], rate, rng)
