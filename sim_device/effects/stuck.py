"""An output stays for a while at the value it had."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import (
    CHANNEL,
    Example,
    Number,
    SimulatedEffect,
    Stage,
    rows,
)


class SimulatedStuck(SimulatedEffect):
    """Stretch of time, and the affected outputs."""

    NUMBERS = {"from_s": Number(), "to_s": Number()}
    WORDS = {"channel": CHANNEL}
    REPEATS = True
    ORDER = 4
    EXAMPLE = Example({"channel": "gy", "from_s": 53.0, "to_s": 57.0})

    def stage(self, full_scale: Array) -> Stage:
        """Held at the first value of the stretch."""
        held: dict[int, float] = {}

        def stick(t: Array, x: Array) -> None:
            stuck = (t >= self["from_s"]) & (t < self["to_s"])
            if not stuck.any():
                return
            for row in rows(self.words["channel"]):
                x[row, stuck] = held.setdefault(row, float(x[row, np.argmax(stuck)]))

        return stick
