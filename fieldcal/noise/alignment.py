"""Gyrocompassing: how well, and how soon, gyroscopes at rest find north.

    sigma_heading(T) = sigma_gyro(T) / (Omega cos(latitude))                       (1)

with the error of a mean over T of the gyroscope that points east (the worst axis). It
has a least where flicker and walk win over white noise. Source: Titterton and Weston,
2nd edition, section 10.4. Units: rad, s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import Array
from fieldcal.noise.averaging import Averaging

NO_NORTH = np.pi / 3**0.5
"""Standard deviation of a heading of which nothing is known, rad."""


@dataclass(frozen=True, slots=True)
class GyrocompassHeading:
    """Heading by gyrocompassing.

    Attributes
    ----------
    seconds : (t,) s at rest
    sigma, low, high : (t,) standard deviation of the heading, rad, and what 68 of 100
        draws have

    """

    seconds: Array
    sigma: Array
    low: Array
    high: Array

    @property
    def best(self) -> tuple[float, float, float]:
        """Seconds at rest after which it gets no better; sigma there, and its ±."""
        i = int(np.argmin(self.sigma))
        spread = (self.high[i] - self.low[i]) / 2
        return float(self.seconds[i]), float(self.sigma[i]), float(spread)


def alignment(
    gyroscopes: list[Averaging], latitude: float
) -> GyrocompassHeading | None:
    """Heading from gyroscopes at rest at a latitude, rad, (1); None if they find none.

    Near a pole nothing of the Earth's rate is level, and north is not found at all.
    """
    turn = EARTH_RATE * float(np.cos(latitude))
    sigma, low, high = (
        np.max([getattr(g, name) for g in gyroscopes], axis=0) / turn
        for name in ("sigma", "low", "high")
    )
    if not sigma.min() < NO_NORTH:
        return None
    return GyrocompassHeading(gyroscopes[0].seconds, sigma, low, high)
