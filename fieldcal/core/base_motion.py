"""Rate and specific force due to a base that moves over the Earth at constant velocity.

Base axes x East, y down, z north, with the latitude phi, the height h, the radii of
curvature M (of the meridian) and N, and the Earth's rate U:

    w = (-v_N / (M + h),  -v_E tan(phi) / (N + h),  v_E / (N + h))              (37)
    f = (-S v_N,  v_N^2 / (M + h) + v_E^2 / (N + h) + 2 U v_E cos(phi),  S v_E)   (1)
    S = 2 U sin(phi) + v_E tan(phi) / (N + h)

w is the rate of the axes in addition to the Earth's rate, rad/s (transport rate). f is
the specific force in addition to gravity, m/s^2: the horizontal part is the Coriolis
force, to which a moving spirit level adjusts; the vertical part is the Eoetvoes effect.
The print of (37) has R for both radii, and its third axis points up. Source: Avrutov
and Pozniak 2023, (37); Groves, Principles of GNSS, Inertial, and Multisensor
Navigation, 2013, chapter 5.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import Array

SEMI_MAJOR, FLATTENING = 6_378_137.0, 1 / 298.257223563
"""Of the WGS84 ellipsoid, m."""


@dataclass(frozen=True, slots=True)
class BaseMotion:
    """Additional rate and specific force of a moving base, in base axes; 0 at rest.

    Attributes
    ----------
    rate : (3,) rad/s, of the level axes in addition to the Earth's rate
    force : (3,) m/s^2, specific force in addition to gravity

    """

    rate: Array = field(default_factory=lambda: np.zeros(3))
    force: Array = field(default_factory=lambda: np.zeros(3))

    @classmethod
    def from_velocity(
        cls, north: float, east: float, latitude: float, height: float = 0.0
    ) -> BaseMotion:
        """Motion of a base from its velocity, m/s, latitude, rad, and height, m.

        >>> BaseMotion.from_velocity(0.0, 10.0, np.deg2rad(60.0)).force.round(5) + 0.0
        array([0.     , 0.00074, 0.00129])
        """
        if not (north or east):
            return cls()
        e2 = FLATTENING * (2 - FLATTENING)
        w2 = 1 - e2 * np.sin(latitude) ** 2
        across = SEMI_MAJOR / np.sqrt(w2) + height
        along = SEMI_MAJOR * (1 - e2) / w2**1.5 + height
        down = east * np.tan(latitude) / across
        rate = np.array([-north / along, -down, east / across])  # (37)
        coriolis = 2 * EARTH_RATE * np.sin(latitude) + down
        lighter = north**2 / along + east**2 / across
        lighter += 2 * EARTH_RATE * east * np.cos(latitude)
        force = np.array([-coriolis * north, lighter, coriolis * east])  # (1)
        return cls(rate, force)

    @property
    def vertical_part(self) -> BaseMotion:
        """Parts about and along the vertical; these do not depend on the heading."""
        vertical = np.array([0.0, 1.0, 0.0])
        return BaseMotion(self.rate * vertical, self.force * vertical)

    @property
    def force_tilt(self) -> float:
        """Angle by which the Coriolis force tilts a gravity of 9.8 m/s^2, rad."""
        return float(np.hypot(self.force[0], self.force[2]) / 9.8)
