"""Outputs are clipped at a limit that is not the full scale."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import (
    ABOVE_ZERO,
    CHANNEL,
    Example,
    Number,
    SimulatedEffect,
    Stage,
    rows,
)


class SimulatedSaturation(SimulatedEffect):
    """Limit at which some outputs are clipped."""

    NUMBERS = {"limit": Number(range=ABOVE_ZERO)}
    WORDS = {"channel": CHANNEL}
    REPEATS = True
    ORDER = 1
    EXAMPLE = Example({"channel": "ay", "limit": 8.0})

    def stage(self, full_scale: Array) -> Stage:
        """Clipped at the limit to both sides."""
        at, limit = rows(self.words["channel"]), self["limit"]

        def clipped(t: Array, x: Array) -> None:
            x[at] = np.clip(x[at], -limit, limit)

        return clipped
