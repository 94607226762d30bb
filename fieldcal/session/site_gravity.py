"""How well a session says how strong gravity is.

Scale factors are measured by gravity, which grows from the equator to the poles, and
falls with height. Where no place is said it may be all of its range, though somebody
may have written a number down (9.81 mostly, which nothing checks); where a latitude is,
that of the heights at which people live; where both are, the normal one but for the
usual anomaly, and where gravity is stated beside them, what the two differ by.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.gravity import gravity
from fieldcal.session.description import Description

ANYWHERE = (gravity(90.0) - gravity(0.0)) / np.sqrt(12.0)
"""What is not known of gravity where no place is, 1 sigma, m/s^2."""

LIVES = 700.0
"""Height at which people live, 1 sigma, m: half of them below 200, some at 2000
(Cohen and Small, Hypsographic demography, 1998)."""

ANOMALY = 3e-4
"""How far gravity usually is from the normal one, 1 sigma, m/s^2 (Torge and Mueller,
Geodesy, 4th edition: free-air anomalies of 30 mGal)."""


def gravity_sigma(about: Description) -> float:
    """What is not known of gravity, 1 sigma, m/s^2."""
    site = about.raw.get("site", {})
    if "latitude_deg" not in site:
        return float(ANYWHERE)
    if "height_m" not in site:
        fall = gravity(about.latitude_deg) - gravity(about.latitude_deg, LIVES)
        return float(np.hypot(fall, ANOMALY))
    normal = gravity(about.latitude_deg, about.height_m)
    at_rest = about.gravity + float(about.under_way.force[1])
    return abs(at_rest - normal) if site.get("gravity") else ANOMALY
