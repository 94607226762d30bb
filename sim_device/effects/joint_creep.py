"""The joints creep: each overshoots in a turn, and relaxes when it has ended.

Beside the angle that a joint is turned to, by the side d = 1, -1 or 0 of each turn,

    y(t) = A sum_k d_k q((t - s_k) / T_k)                   during the turn
    y(t) = A sum_k d_k exp(-(t - s_k - T_k) / tau)          after it       (1)

s_k and T_k the start of a turn and its duration, q a polynomial of fifth degree from 0
to 1 that is at rest at both ends. A in degrees, tau in s.
"""

from __future__ import annotations

import numpy as np

from fieldcal.sim_device.effect import ABOVE_ZERO, Example, Number, SimulatedEffect
from fieldcal.sim_device.joints import Creep


class SimulatedJointCreep(SimulatedEffect):
    """Overshoot of alpha and beta, and time constant of their relaxation."""

    VECTOR = ("alpha_deg", "beta_deg")
    NUMBERS = {"tau_s": Number(range=ABOVE_ZERO)}
    REPEATS = True
    EXAMPLE = Example({"alpha_deg": 0.12, "beta_deg": -0.08, "tau_s": 4.0})

    def creep(self) -> Creep | None:
        """What comes beside the angles (1)."""
        alpha, beta = np.deg2rad(self.column(self.VECTOR))[:, 0]
        return Creep(np.array([alpha, beta, 0.0, 0.0]), self["tau_s"])
