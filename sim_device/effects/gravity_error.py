"""Gravity is not what it should be at the site.

g <- g (1 + relative)
"""

from __future__ import annotations

from fieldcal.sim_device.effect import Example, Number, Range, SimulatedEffect


class SimulatedGravityError(SimulatedEffect):
    """Gravity that differs from the site's nominal value."""

    NUMBERS = {
        "relative": Number(
            range=Range("between -0.5 and 0.5", lambda v: -0.5 < v < 0.5)
        )
    }
    EXAMPLE = Example(
        {"relative": 2e-3}, unmended="the scale factors take all of it up"
    )

    def gravity(self, g: float) -> float:
        """Stronger by so much."""
        return g * (1 + self["relative"])
