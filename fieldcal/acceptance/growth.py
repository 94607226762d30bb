"""Errors of an inertial navigator that the calibration's uncertainty causes.

The navigator is levelled at home with the accelerometers just calibrated, then flies on
its own for t at about the attitude it was levelled in. In procedure axes (x and z
level, y down), with db, dk the remaining errors of bias and scale factor of the
accelerometers, dw those of the gyroscopes' bias, g gravity:

    theta_0 = db_level / g                                tilt by levelling         (1)
    theta_level(t) = theta_0 + dw_level t                 tilt                      (2)
    theta_y(t) = dw_y t                                   heading                   (3)
    dv_level(t) = db' t + g theta_0 t + g dw t^2 / 2      tilt lets gravity in      (4)
    dv_y(t) = (db_y - g dk_y) t                           f_y = -g                  (5)

All variances follow from the covariance C of the parameters, var = J C J^T. At once
after levelling db and g theta_0 in (4) cancel, until the vehicle turns; db' is db in
its new heading, and the two are taken as independent. Level axes are crossed in (4):
a tilt about x lets gravity into z. Schuler's loop, which makes (4) smaller by 5 % at 10
minutes, is left out. So is what the calibration does not contain: the sensors' own
noise, scale factors in turns, and a change of bias since.

Frame: procedure axes, procedure = P @ device. Units: rad, m/s. Source: Titterton and
Weston, Strapdown Inertial Navigation Technology, 2nd edition, chapter 12, short term.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.core.samples import Array

TIMES = (60.0, 600.0)
"""Times for which the errors are given, s."""

LEVEL, DOWN = [0, 2], 1
"""Rows of the procedure's axes."""


@dataclass(frozen=True, slots=True)
class NavigationErrors:
    """Standard deviations of the errors after some time; nan where not determined.

    Attributes
    ----------
    seconds : s
    tilt, heading : rad; of the tilt, the worse level axis
    level, vertical : velocity, m/s; of the level velocity, the worse axis

    """

    seconds: float
    tilt: float
    heading: float
    level: float
    vertical: float

    def to_json(self) -> dict[str, Any]:
        """Return the object that stands in result.json; null where not determined."""
        return {
            "seconds": self.seconds,
            "tilt_sigma_deg": _number(np.rad2deg(self.tilt)),
            "heading_sigma_deg": _number(np.rad2deg(self.heading)),
            "level_velocity_sigma_m_s": _number(self.level),
            "vertical_velocity_sigma_m_s": _number(self.vertical),
        }


def navigation_errors(
    calibration: Calibration, gravity: float, mounting: Array, seconds: float
) -> NavigationErrors:
    """Errors after `seconds` by (1)-(5).

    Parameters
    ----------
    calibration : whose uncertainty it is
    gravity : m/s^2
    mounting : (3, 3), procedure = mounting @ device
    seconds : s

    """
    t, g = seconds, gravity
    acc = _covariance(calibration, "acc_bias", mounting)
    gyr = _covariance(calibration, "gyr_bias", mounting)
    bias, rate = np.diag(acc)[LEVEL], np.diag(gyr)[LEVEL]
    tilt0 = bias[::-1] / g**2  # (1), about x from z and about z from x
    tilt = tilt0 + rate * t**2  # (2)
    heading = gyr[DOWN, DOWN] * t**2  # (3)
    level = 2 * bias * t**2 + g**2 * rate[::-1] * t**4 / 4  # (4)
    vertical = _vertical(calibration, g, mounting) * t**2  # (5)
    return NavigationErrors(
        t,
        float(np.sqrt(tilt.max())),
        float(np.sqrt(heading)),
        float(np.sqrt(level.max())),
        float(np.sqrt(vertical)),
    )


def _covariance(calibration: Calibration, group: str, mounting: Array) -> Array:
    """Covariance of a bias in procedure axes, (3, 3); nan where not determined."""
    names = [f"{group}.{axis}" for axis in "xyz"]
    if not set(names) <= set(calibration.names):
        return np.full((3, 3), np.nan)
    rows = [calibration.names.index(n) for n in names]
    turned: Array = mounting @ calibration.covariance[np.ix_(rows, rows)] @ mounting.T
    return turned


def _vertical(calibration: Calibration, gravity: float, mounting: Array) -> float:
    """Variance of (5) over t^2; a scale factor left nominal counts as exact."""
    axis = "xyz"[int(np.argmax(np.abs(mounting[DOWN])))]
    sign = mounting[DOWN].sum()
    names = calibration.names
    if f"acc_bias.{axis}" not in names:
        return float("nan")
    j = np.zeros(len(names))
    j[names.index(f"acc_bias.{axis}")] = sign
    if f"acc_scale.{axis}" in names:
        # the device axis sees f = sign (-g), and sign once more back to the procedure
        j[names.index(f"acc_scale.{axis}")] = -gravity
    return float(j @ calibration.covariance @ j)


def _number(value: float) -> float | None:
    return float(f"{value:.4g}") if np.isfinite(value) else None
