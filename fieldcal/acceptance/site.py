"""Where a recalibration was made: gravity is what scale factors are measured by.

From the equator to a pole it grows by half a percent, more than most scale factors are
off. Nobody's latitude can be taken from the samples, since a scale factor of all three
axes does the same.
"""

from __future__ import annotations

from fieldcal.core.gravity import gravity
from fieldcal.session.description import Description


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
