"""Where a recalibration was made: gravity is what scale factors are measured by.

From the equator to a pole it grows by half a percent, more than most scale factors are
off. Nobody's latitude can be taken from the samples, since a scale factor of all three
axes does the same. So gravity that somebody states is held against that of the place:
mountains and trenches make it differ by 0.004 m/s^2 at most (Torge and Mueller,
Geodesy, 4th edition, free-air anomalies), and a height that nobody states is somewhere
between the sea and the highest villages.
"""

from __future__ import annotations

from fieldcal.core.gravity import gravity
from fieldcal.session.description import Description

ANOMALY = 4e-3
"""How far gravity may be from the normal one of a place, m/s^2."""

VILLAGES = 5000.0
"""Height up to which people live, m."""


def gravity_unknown(about: Description) -> str:
    """Sentence where nobody said how strong gravity is, with the remedy; else empty."""
    if about.gravity_said:
        return ""
    least, most = gravity(0.0), gravity(90.0)
    return (
        "nobody said where this is, and gravity, by which scale factors are measured,"
        f" is {least:.3f} m/s² at the equator and {most:.3f} m/s² at the poles: say it"
        " (--latitude and --height, or --gravity; afterwards in [site] of session.toml:"
        " latitude_deg and height_m)"
    )


def place_wanted(about: Description) -> str:
    """Remedy where the place would say gravity better; empty where it is said."""
    site = about.raw.get("site", {})
    if "latitude_deg" not in site:
        return "; nothing checks the gravity that is stated: say the place (--latitude)"
    return "" if "height_m" in site else "; say the height of the place (--height)"


def gravity_contradicted(about: Description) -> str:
    """Sentence where the gravity that is stated cannot be that of the place."""
    site = about.raw.get("site", {})
    if not site.get("gravity"):
        return ""
    least, most, where = gravity(0.0, VILLAGES), gravity(90.0), "anywhere on Earth"
    if "latitude_deg" in site:
        height = site.get("height_m")
        high, low = (VILLAGES, 0.0) if height is None else (height, height)
        most = gravity(about.latitude_deg, low)
        least = gravity(about.latitude_deg, high)
        where = f"at {about.latitude_deg:g}° latitude"
        where += "" if height is None else f" and {height:g} m"
    if least - ANOMALY <= about.gravity <= most + ANOMALY:
        return ""
    usual = f"{least:.4f}" if least == most else f"{least:.4f} to {most:.4f}"
    return (
        f"[site] gravity = {about.gravity:.5g} m/s² cannot be: {where} it is {usual}"
        f" m/s², give or take {ANOMALY:g}; mend gravity, or latitude_deg and height_m,"
        " and solve again"
    )
