"""The sensors follow as a Butterworth low-pass of second order does.

    U(t) = int_0^inf u(t - s) h(s) ds,
    h(s) = sqrt(2) / tau exp(-s / (sqrt(2) tau)) sin(s / (sqrt(2) tau))

of each triad's noiseless outputs u, by Simpson's rule over 24 time constants. Vibration
is drawn sample by sample and passes.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import NOT_NEGATIVE, Example, Number, SimulatedEffect

PAST, STEPS = 24.0, 120
"""Time constants of the past that count, and parts of them."""


class SimulatedSecondOrder(SimulatedEffect):
    """Time constants of both triads, s."""

    NUMBERS = {
        "acc": Number(0.0, NOT_NEGATIVE),
        "gyr": Number(0.0, NOT_NEGATIVE),
    }
    EXAMPLE = Example({"acc": 0.03, "gyr": 0.04}, in_motion=True)

    def followed(self, outputs: Callable[[Array], Array], t: Array) -> Array:
        """Outputs (6, n) at t (n,) s as the sensors follow them."""
        now = outputs(t)
        for rows, tau in ((slice(3), self["acc"]), (slice(3, 6), self["gyr"])):
            if tau:
                now[rows] = sum(
                    share * outputs(t - tau * age)[rows] for age, share in _past()
                )
        return now


def _past() -> list[tuple[float, float]]:
    """Ages in time constants, and their shares."""
    ages = np.linspace(0.0, PAST, STEPS + 1)
    slow = ages / np.sqrt(2)
    shares = np.exp(-slow) * np.sin(slow)
    shares *= np.where(np.arange(STEPS + 1) % 2, 4.0, 2.0)
    shares[[0, -1]] /= 2
    return list(zip(ages.tolist(), (shares / shares.sum()).tolist(), strict=True))
