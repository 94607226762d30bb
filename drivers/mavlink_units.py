"""What the numbers of MAVLink's IMU messages are worth.

The fields are whole numbers cut toward zero: k stands for x with

    k > 0: k <= x < k + 1;   k < 0: k - 1 < x <= k;   k = 0: -1 < x < 1     (1)

so the mean of x is k + sign(k)/2, and its variance 1/12, or 1/3 for k = 0.  (2)
Without (2) a fit puts 1/2 into every output, 0.05 % of 1 g in milli-g.

The unit of acceleration differs between programs, so it is told from samples at rest:
the unit u for which the median of |k| u is within `UNIT_TOLERANCE` of g.
(3)

Symbols: k field, x what was measured in the unit of the field. Device axes as sent.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.errors import DeviceError
from fieldcal.core.samples import Array

G = 9.80665
"""m/s^2; what autopilots call g."""

ACCELERATIONS = {
    "mg": 1e-3 * G, "mm/s^2": 1e-3, "cm/s^2": 1e-2, "m/s^2": 1.0, "g": G
}  # fmt: skip
RATES = {"mrad/s": 1e-3, "rad/s": 1.0, "deg/s": float(np.pi / 180)}

LIKELY_UNITS = {True: ("mg", "mm/s^2"), False: ("m/s^2", "g")}
"""Units looked for in whole numbers, and in others; cm/s^2 is too close to mg."""

UNIT_TOLERANCE = 0.2
"""Share of g by which a device may be off that still tells its unit."""


def untruncated_mean(k: Array) -> Array:
    """Return the mean of what was cut toward zero to `k`, (2)."""
    return k + 0.5 * np.sign(k)


def recognise_unit(acc: Array, whole: bool) -> str | None:
    """Name the unit of accelerations (n, 3), (3); None if none fits.

    >>> recognise_unit(np.array([[0.0, 3.0, -1001.0]]), whole=True)
    'mg'
    """
    size = float(np.median(np.linalg.norm(acc, axis=1)))
    for name in LIKELY_UNITS[whole]:
        if abs(size * ACCELERATIONS[name] / G - 1) < UNIT_TOLERANCE:
            return name
    return None


def unit_error(acc: Array, whole: bool, message: str) -> DeviceError:
    """Say that no unit fits accelerations (n, 3)."""
    size = float(np.median(np.linalg.norm(acc, axis=1)))
    units = " nor ".join(
        f"1 g in {name} ({G / ACCELERATIONS[name]:.4g})" for name in LIKELY_UNITS[whole]
    )
    known: Mapping[str, float] = ACCELERATIONS
    return DeviceError(
        f"{message} says |acceleration| = {size:.4g}, which is neither {units}: hold "
        f"the device still, or name the unit with acc_unit={'|'.join(known)}"
    )
