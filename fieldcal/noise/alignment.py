"""Gyrocompassing: heading error of gyroscopes at rest against averaging time.

    sigma_heading(T) = sigma_gyro(T) / (Omega cos(latitude))                       (1)

with the error of a mean over T of the gyroscope that points east (the worst axis), by
noise alone: what its bias has changed by since its calibration adds to it. It is least
where flicker and random walk begin to exceed white noise. Source: D. Titterton and
J. Weston, 2nd edition, section 10.4. Units: rad, s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import Array
from fieldcal.noise.averaging import AveragingError

NO_NORTH = np.pi / 3**0.5
"""Standard deviation of a heading of which nothing is known, rad."""


@dataclass(frozen=True, slots=True)
class GyrocompassHeading:
    """Heading by gyrocompassing.

    Attributes
    ----------
    seconds : (t,) s at rest
    sigma, low, high : (t,) standard deviation of the heading, rad; its 68 % interval

    """

    seconds: Array
    sigma: Array
    low: Array
    high: Array

    @property
    def best(self) -> tuple[float, float, float]:
        """Time at rest with the least sigma, s; that sigma, and its uncertainty."""
        i = int(np.argmin(self.sigma))
        spread = (self.high[i] - self.low[i]) / 2
        return float(self.seconds[i]), float(self.sigma[i]), float(spread)


def gyrocompass_heading(
    gyroscopes: list[AveragingError], latitude: float
) -> GyrocompassHeading | None:
    """Heading error of gyroscopes at a latitude, rad, (1); None if they find no north.

    Near a pole the Earth's rate has no level component, and north cannot be found.
    """
    turn = EARTH_RATE * float(np.cos(latitude))
    sigma, low, high = (
        np.max([getattr(g, name) for g in gyroscopes], axis=0) / turn
        for name in ("sigma", "low", "high")
    )
    if not sigma.min() < NO_NORTH:
        return None
    return GyrocompassHeading(gyroscopes[0].seconds, sigma, low, high)
