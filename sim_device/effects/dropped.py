"""Samples get lost on their way, each by itself."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fieldcal.sim_device.effect import Example, Number, Range, SimulatedEffect


class SimulatedDropped(SimulatedEffect):
    """Fraction of samples that are lost."""

    NUMBERS = {
        "fraction": Number(range=Range("0 or more, below 1", lambda v: 0 <= v < 1))
    }
    EXAMPLE = Example(
        {"fraction": 0.03}, unmended="the samples that are left are as good as before"
    )

    def arrival(self, rng: np.random.Generator) -> Callable[[int], NDArray[np.bool_]]:
        """Which samples are not lost."""
        return lambda n: rng.random(n) >= self["fraction"]
