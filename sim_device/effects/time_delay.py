"""The gyroscopes are late against the accelerometers; if negative, these are."""

from __future__ import annotations

from fieldcal.sim_device.effect import Example, Number, Range, SimulatedEffect


class SimulatedTimeDelay(SimulatedEffect):
    """Delay of the gyroscopes, s."""

    NUMBERS = {
        "seconds": Number(range=Range("between -1 and 1", lambda v: abs(v) <= 1))
    }
    EXAMPLE = Example({"seconds": 0.03})

    def lag(self) -> float:
        """Delay of the gyroscopes, s."""
        return self["seconds"]
