"""Stamps of the samples are off: by chance, and by the steps of a coarse clock.

    stamp = floor(t / step) step + jitter n,    taken at t + (1 - share) (stamp - t)

t even times, s; n standard normal.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import NOT_NEGATIVE, Example, Number, SimulatedEffect


class SimulatedStampError(SimulatedEffect):
    """Share of the stamps' unevenness that is their error, its rms and steps, s."""

    NUMBERS = {
        "share": Number(1.0),
        "jitter": Number(0.0, NOT_NEGATIVE),
        "step": Number(0.0, NOT_NEGATIVE),
    }
    EXAMPLE = Example({"share": 1.0, "jitter": 0.002}, in_motion=True)

    def stamps(
        self, rng: np.random.Generator
    ) -> Callable[[Array], tuple[Array, Array]] | None:
        """Stamps of samples at even times (n,) s, and when they are taken."""

        def stamped(t: Array) -> tuple[Array, Array]:
            step = self["step"]
            shown = np.floor(t / step) * step if step else t
            shown = shown + self["jitter"] * rng.standard_normal(len(t))
            return shown, t + (1 - self["share"]) * (shown - t)

        return stamped
