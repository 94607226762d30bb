"""Uncertainty of the gravity that a session states.

Scale factors are measured against gravity, which increases from the equator to the
poles, and decreases with height. The standard deviation is

- without a latitude: that of the whole range on Earth, even if gravity is stated, since
  nothing checks that number;
- with a latitude only: that of the heights at which people live;
- with latitude and height: that of the usual gravity anomaly, or, if
  gravity is stated as well, its difference from normal gravity.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.gravity import normal_gravity
from fieldcal.session.description import Description

UNKNOWN_PLACE_SIGMA = (normal_gravity(90.0) - normal_gravity(0.0)) / np.sqrt(12.0)
"""Standard deviation of gravity at an unknown place, m/s^2."""

HEIGHT_SIGMA = 700.0
"""Standard deviation of the height at which people live, m: half below 200, some at
2000 (Cohen and Small, Hypsographic demography, 1998)."""

ANOMALY_SIGMA = 3e-4
"""Standard deviation of gravity from normal gravity, m/s^2 (Torge and Mueller,
Geodesy, 4th edition: free-air anomalies of 30 mGal)."""


def gravity_sigma(about: Description) -> float:
    """Standard deviation of the stated gravity, m/s^2."""
    site = about.raw.get("site", {})
    if about.latitude_deg is None:
        return float(UNKNOWN_PLACE_SIGMA)
    if "height_m" not in site:
        fall = normal_gravity(about.latitude_deg) - normal_gravity(
            about.latitude_deg, HEIGHT_SIGMA
        )
        return float(np.hypot(fall, ANOMALY_SIGMA))
    normal = normal_gravity(about.latitude_deg, about.height_m)
    at_rest = about.gravity + float(about.base_motion.force[1])
    return abs(at_rest - normal) if site.get("gravity") else ANOMALY_SIGMA
