"""Whether gravity and the Earth's rate at the site are known, as references.

From the equator to a pole gravity grows by half a percent, more than most scale factors
are off. The samples do not show the latitude, since a common scale factor of all three
axes has the same effect. A stated gravity is therefore compared with the normal gravity
of the site. Mountains and trenches change it by 0.004 m/s^2 at most (Torge and Mueller,
Geodesy, 4th edition, free-air anomalies), and a height that is not stated is taken as
between the sea and the highest villages.
"""

from __future__ import annotations

from fieldcal.acceptance.check import Check
from fieldcal.calibration import Calibration
from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.gravity import normal_gravity
from fieldcal.session.description import Description

ANOMALY = 4e-3
"""Largest difference of gravity from the normal gravity of a place, m/s^2."""

VILLAGES = 5000.0
"""Height up to which people live, m."""


def gravity_missing_warning(about: Description) -> str:
    """Sentence with the remedy if gravity is not stated; else empty."""
    if about.gravity_stated:
        return ""
    least, most = normal_gravity(0.0), normal_gravity(90.0)
    return (
        "the site is not stated, and gravity, to which scale factors refer, is"
        f" {least:.3f} m/s² at the equator and {most:.3f} m/s² at the poles: state it"
        " (--latitude and --height, or --gravity; fieldcal run --resume accepts them"
        " afterwards, or write latitude_deg and height_m into [site] of session.toml)"
    )


def latitude_missing_warning(about: Description) -> str:
    """Sentence with the remedy if gyroscopes need a latitude; else empty."""
    if about.grade != "navigation" or about.latitude_deg is not None:
        return ""
    return (
        "the latitude is not stated: gyroscopes of navigation grade are calibrated by"
        f" the Earth's rate, and their biases contain up to {EARTH_RATE:.1e} rad/s of"
        " it: state it (--latitude; fieldcal run --resume accepts it afterwards, or"
        " write latitude_deg into [site] of session.toml)"
    )


def site_remedy(about: Description) -> str:
    """Remedy if the site is not fully stated, as part of a sentence; else empty."""
    site = about.raw.get("site", {})
    if about.latitude_deg is None:
        return "; the stated gravity is not checked: state the site (--latitude)"
    return "" if "height_m" in site else "; state the height of the site (--height)"


def gravity_contradiction(about: Description) -> str:
    """Sentence if the stated gravity is impossible at the site; else empty."""
    site = about.raw.get("site", {})
    if not site.get("gravity"):
        return ""
    least, most, where = (
        normal_gravity(0.0, VILLAGES),
        normal_gravity(90.0),
        "anywhere on Earth",
    )
    if about.latitude_deg is not None:
        height = site.get("height_m")
        high, low = (VILLAGES, 0.0) if height is None else (height, height)
        most = normal_gravity(about.latitude_deg, low)
        least = normal_gravity(about.latitude_deg, high)
        where = f"at {about.latitude_deg:g}° latitude"
        where += "" if height is None else f" and {height:g} m"
    if least - ANOMALY <= about.gravity <= most + ANOMALY:
        return ""
    usual = f"{least:.4f}" if least == most else f"{least:.4f} to {most:.4f}"
    return (
        f"[site] gravity = {about.gravity:.5g} m/s² is impossible: {where} it is"
        f" {usual} m/s², and differs from that by {ANOMALY:g} m/s² at most; correct"
        " gravity, or latitude_deg and height_m, and solve again"
    )


def check_site(calibration: Calibration, about: Description) -> list[Check]:
    """Check whether what calibrates the sensors is known: gravity, the Earth's rate."""
    wrong = ""
    if "acc_scale" in calibration.groups:
        wrong = gravity_missing_warning(about) or gravity_contradiction(about)
    if not wrong and "gyr_bias" in calibration.groups:
        wrong = latitude_missing_warning(about)
    return [Check("site", False, wrong)] if wrong else []
