"""A rotation that both triads share: of the device in its mount, or of its sensors.

A device that is fastened askew by a small angle phi, or held by a joint whose zero is
off, measures f - phi x f, and so do sensors that are turned in their housing. Then

    k23 - k32 = 2 phi_x,    k31 - k13 = 2 phi_y,    k12 - k21 = 2 phi_z             (1)

to first order, and the same holds for the s of the gyroscopes. No position tells one
from the other: a result with cross-coupling takes all of it for the device's.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fieldcal.acceptance.check import Check
from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits

SURE = 5.0
"""Standard deviations by which a rotation must exceed the usual one."""

ALIKE = 3.0
"""Standard deviations within which both triads are turned alike."""

ABOUT = ("23", "31", "12")
"""Row and column of the first coefficient of (1), by axis."""


class _Rotation(NamedTuple):
    """Rotation about one axis and its standard uncertainty, rad."""

    angle: float
    sigma: float


def check_common_rotation(calibration: Calibration, limits: GradeLimits) -> list[Check]:
    """State a rotation of both triads that is more than sensors usually have."""
    turned = []
    for axis, first in zip("xyz", ABOUT, strict=True):
        acc = _rotation(calibration, "cross_coupling.k", first)
        gyr = _rotation(calibration, "gyro_cross_coupling.s", first)
        if (
            acc is None
            or abs(acc.angle) < limits.factory.cross_coupling + SURE * acc.sigma
        ):
            continue
        apart = ALIKE * math.hypot(acc.sigma, gyr.sigma) if gyr else math.inf
        if gyr and abs(acc.angle - gyr.angle) > apart:
            continue  # one triad is turned in the device
        size, sigma = map(math.degrees, (acc.angle, acc.sigma))
        also = ", and so are the gyroscopes" if gyr else ""
        turned.append(f"by {size:.2f} ± {sigma:.2f}° about {axis}{also}")
    if not turned:
        return []
    says = (
        f"the accelerometers are turned {'; '.join(turned)}: this result takes it for"
        " the device's own. If the device is fastened askew, or a joint's zero is off,"
        " it is not: fasten it straight, set the joints to zero with the level, and"
        " record again"
    )
    return [Check("mounting", None, says)]


def _rotation(calibration: Calibration, prefix: str, first: str) -> _Rotation | None:
    """Rotation by (1); None if not both coefficients are determined."""
    pair = [f"{prefix}{first}", f"{prefix}{first[::-1]}"]
    names = list(calibration.names)
    if not set(pair) <= set(names):
        return None
    at = [names.index(name) for name in pair]
    share = np.array([0.5, -0.5])  # (1)
    variance = share @ calibration.covariance[np.ix_(at, at)] @ share
    return _Rotation(
        float(share @ calibration.values[at]), math.sqrt(max(variance, 0.0))
    )
