"""What a base that moves over the Earth at a constant velocity adds to references.

Base axes x East, y down, z north, with the latitude phi, the height h, the radii of
curvature M (of the meridian) and N, and the Earth's rate U:

    w = (-v_N / (M + h),  -v_E tan(phi) / (N + h),  v_E / (N + h))              (37)
    f = (-S v_N,  v_N^2 / (M + h) + v_E^2 / (N + h) + 2 U v_E cos(phi),  S v_E)   (1)
    S = 2 U sin(phi) + v_E tan(phi) / (N + h)

w is the rate of the axes themselves beside the Earth's, rad/s; f the specific force
beside gravity, m/s^2: Coriolis across, which a spirit level under way hangs along, and
down what makes a ship that sails east lighter (Eoetvoes). In (37) R stands for both
radii; its third axis is printed upwards. Source: Avrutov and Pozniak 2023, (37);
Groves, Principles of GNSS, Inertial, and Multisensor Navigation, 2013, chapter 5.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import Array

SEMI_MAJOR, FLATTENING = 6_378_137.0, 1 / 298.257223563
"""Of the WGS84 ellipsoid, m."""


@dataclass(frozen=True, slots=True)
class UnderWay:
    """What the motion of the base adds, in base axes; nothing if it stands.

    Attributes
    ----------
    rate : (3,) rad/s, of the level axes beside the Earth's rate
    force : (3,) m/s^2, specific force beside gravity

    """

    rate: Array = field(default_factory=lambda: np.zeros(3))
    force: Array = field(default_factory=lambda: np.zeros(3))

    @classmethod
    def at(
        cls, north: float, east: float, latitude: float, height: float = 0.0
    ) -> UnderWay:
        """A base with a velocity in m/s, at a latitude in rad and a height in m.

        >>> UnderWay.at(0.0, 10.0, np.deg2rad(60.0)).force.round(5) + 0.0
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
    def level(self) -> UnderWay:
        """What is left where nobody knows north: about and along the vertical."""
        vertical = np.array([0.0, 1.0, 0.0])
        return UnderWay(self.rate * vertical, self.force * vertical)

    @property
    def lean(self) -> float:
        """By how much Coriolis turns the force, for a gravity of 9.8 m/s^2, rad."""
        return float(np.hypot(self.force[0], self.force[2]) / 9.8)
