"""What nobody said of a recording, or what nothing checks, in the uncertainties.

Scale factors are measured by gravity, which grows from the equator to the poles, and
falls with height h:

    k = U / g,   dk_i = -k_i dg / g   of all axes together                         (1)

dg is what is not known of gravity: all of its range where no place is said, though
somebody may have written a number down (9.81 mostly, which nothing checks); the heights
at which people live where a latitude is; the usual anomaly where both are, and where
gravity is stated beside them, what the two differ by.

Values on a grid of steps q that were rounded down are q / 2 too small,

    db_i = q_i / 2                                                                 (2)

which is there with some probability P where the step does not come from whoever knows
how values are rounded; P times its square is added to the variance. What values cut
toward zero do hangs on the signs of the means, and is in the model (`solve.given`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.core.gravity import gravity
from fieldcal.core.samples import Array
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
    return abs(about.gravity - normal) if site.get("gravity") else ANOMALY


def with_unsaid(found: Calibration, about: Description, floored: Array) -> Calibration:
    """The calibration with (1) and (2) where they are not known.

    Parameters
    ----------
    found : calibration of the session
    about : where it was made
    floored : (3,) m/s^2, (2) of each accelerometer times the root of P

    """
    names, more = found.names, np.zeros_like(found.covariance)
    rows = _rows("acc_scale", names)
    k = found.values[rows] * gravity_sigma(about) / about.gravity  # (1)
    more[np.ix_(rows, rows)] += np.outer(k, k)
    for row in _rows("acc_bias", names):
        more[row, row] += floored["xyz".index(names[row][-1])] ** 2  # (2)
    return replace(found, covariance=found.covariance + more)


def _rows(group: str, names: tuple[str, ...]) -> list[int]:
    return [i for i, name in enumerate(names) if name.startswith(f"{group}.")]
