"""Whether the parameters are known well enough for the grade."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.acceptance.check import Check, unit_suffix
from fieldcal.acceptance.site import site_remedy
from fieldcal.calibration import COMPONENTS, Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.calibration.names import group_of, sensor_of
from fieldcal.session.description import Description
from fieldcal.windows.mean import Average

UNCERTAINTY = " uncertainty"
"""End of a check's name, after the group whose uncertainty it compares."""

REQUIRED = ("acc_bias", "acc_scale", "gyr_bias")
"""Groups that must be determined within their limit, if their sensor was recorded."""


def check_uncertainty(
    calibration: Calibration,
    about: Description,
    limits: GradeLimits,
    windows: Sequence[Average],
) -> list[Check]:
    """Check the uncertainty of each group that has a limit.

    A recorded sensor of which no parameter was determined fails.
    """
    checks = []
    read = {
        sensor_of(group_of(name)) for name in calibration.names
    } | _measured_sensors(windows)
    for group in COMPONENTS:
        limit = limits.sigma(group)
        sensor_read = sensor_of(group) in read
        if limit is None or not sensor_read:
            continue
        unit = COMPONENTS[group][1]
        shown = unit_suffix(unit)
        _, sigma = calibration.vector(group)
        lacking = [a for a, s in zip("xyz", sigma, strict=True) if not np.isfinite(s)]
        if lacking and group in REQUIRED:
            says = f"{group} {' '.join(lacking)} was not determined by these positions"
            checks.append(Check(group + UNCERTAINTY, False, says))
        elif not lacking:
            worst = int(np.argmax(sigma))
            ok = bool(sigma[worst] <= limit)
            says = (
                f"{group} {'xyz'[worst]} is known to ±"
                f" {_format_apart_from(sigma[worst], limit)}{shown},"
                f" {'within' if ok else 'more than'} {limit:.2g}{shown}"
            )
            if not ok and group == "acc_scale":
                says += site_remedy(about)
            if not ok and sensor_of(group) == "acc":
                says += _angle_setting_remedy(calibration, limits)
            stands: bool | None = ok
            if not ok and group not in REQUIRED:
                stands, says = None, f"{says}: it counts as not determined"
            value = float(sigma[worst])
            checks.append(Check(group + UNCERTAINTY, stands, says, value, limit, unit))
    return checks


def _measured_sensors(windows: Sequence[Average]) -> set[str]:
    """Sensors with three axes in some window, as in `names.sensor_of`."""
    has = [np.isfinite(window.mean) for window in windows]
    sides = {"acc": slice(0, 3), "gyr": slice(3, 6)}
    return {name for name, s in sides.items() if any(h[s].all() for h in has)}


def _format_apart_from(value: float, limit: float) -> str:
    """A value with enough digits to distinguish it from its limit.

    >>> _format_apart_from(0.02041, 0.02), _format_apart_from(0.03123, 0.02)
    ('0.0204', '0.031')
    """
    for digits in range(2, 7):
        text = f"{value:.{digits}g}"
        if float(text) != float(f"{limit:.{digits}g}"):
            break
    return text


def _angle_setting_remedy(calibration: Calibration, limits: GradeLimits) -> str:
    """Remedy if the setting of angles limits the uncertainty; else empty."""
    angles = float(calibration.info.get("angle_sigma_deg") or 0.0)
    if calibration.method == "scalar" or angles < limits.angle_setting_deg:
        return ""
    return (
        f"; the angles are taken as set to ± {angles:.2g}°: if they are set better,"
        " state it (--angles); if not, use larger angles"
    )
