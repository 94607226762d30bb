"""Bounds beyond which a device is not at rest, whatever its noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array

SWINGS = 16.0
"""Longest period of swaying, s."""


@dataclass(frozen=True, slots=True)
class StillnessLimits:
    """Absolute bounds; stillness itself is judged against the device's own noise.

    Attributes
    ----------
    acc, gyr : m/s^2, rad/s: largest standard deviation of 0.1 s means at rest; it is
        less on a running vehicle and in a hand
    acc_drift, gyr_drift : m/s^2, rad/s: largest steady change over a window; it is less
        while a device warms up
    unjudged_s : least length of a window that is judged, s: what sways slowly looks
        like a drift in a shorter one

    """

    acc: float = 0.5
    gyr: float = 0.1
    acc_drift: float = 0.1
    gyr_drift: float = 0.01
    unjudged_s: float = 0.0

    @classmethod
    def swaying(cls) -> StillnessLimits:
        """Limits for a base that sways: a slow oscillation looks like a drift."""
        still = cls()
        return cls(acc_drift=2 * still.acc, gyr_drift=2 * still.gyr, unjudged_s=SWINGS)

    @property
    def noise(self) -> Array:
        """Bound on the noise of each channel, (6,)."""
        return np.repeat([self.acc, self.gyr], 3)

    @property
    def drift(self) -> Array:
        """Bound on the drift of each channel, (6,)."""
        return np.repeat([self.acc_drift, self.gyr_drift], 3)
