"""Normal gravity of the WGS84 ellipsoid at a latitude and height.

    g0 = ge (1 + k sin^2 phi) / sqrt(1 - e^2 sin^2 phi)
    g  = g0 (1 - 2 (1 + f + m - 2 f sin^2 phi) h / a + 3 (h / a)^2)

Source: NIMA TR8350.2, third edition, equations (4-1) and (4-3), and its constants.
"""

from __future__ import annotations

import math

from fieldcal.core.errors import InputError

G0 = 9.80665
"""Standard gravity, m/s^2: the unit "g" of data sheets."""

_GE = 9.7803253359
_K = 0.00193185265241
_E2 = 0.00669437999014
_A = 6378137.0
_F = 1 / 298.257223563
_M = 0.00344978650684


def normal_gravity(latitude_deg: float, height_m: float = 0.0) -> float:
    """Normal gravity in m/s^2.

    Raises
    ------
    InputError
        If the place is not on the Earth's surface or in the air above it.

    >>> round(normal_gravity(50.45, 170.0), 5)
    9.81058
    """
    if not -90 <= latitude_deg <= 90 or not -1000 <= height_m <= 100_000:
        raise InputError(
            f"no gravity for latitude {latitude_deg}° and height {height_m} m: "
            "latitude is -90 to 90°, height -1000 to 100000 m"
        )
    s2 = math.sin(math.radians(latitude_deg)) ** 2
    g0 = _GE * (1 + _K * s2) / math.sqrt(1 - _E2 * s2)  # (4-1)
    h = height_m / _A
    return g0 * (1 - 2 * (1 + _F + _M - 2 * _F * s2) * h + 3 * h * h)  # (4-3)
