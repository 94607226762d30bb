"""A misfit that is too small to matter for navigation.

Chi-squared of a device with low noise is significant even for a scatter r of its
windows that is too small to matter. The uncertainties of the estimate include r. With s
the uncertainty of a bias that the grade allows,

    sqrt(s^2 + r^2) < 1.005 s   if   r <= s / 10                                   (1)

so such a scatter does not matter, for accelerometers and gyroscopes alike. This holds
for scatter only: if a single window may be wrong, chi-squared decides.
"""

from __future__ import annotations

from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.model import thresholds

MAX_HARMLESS_RATIO = 0.1
"""Largest r over s, (1)."""


def harmless_scatter_note(
    calibration: Calibration, limits: GradeLimits, sensor: str
) -> str:
    """Part of a sentence: why a misfit does not matter; empty if it may matter."""
    of = calibration.info if sensor == "acc" else calibration.info["gyroscopes"]
    scatter, unit = of.get("extra_scatter"), "m/s²" if sensor == "acc" else "rad/s"
    doubt = max(calibration.info.get("bad_position", ()), default=0.0)
    most = MAX_HARMLESS_RATIO * (limits.sigma(f"{sensor}_bias") or 0.0)
    if scatter is None or not 0 < scatter <= most or doubt >= thresholds.SUSPECT:
        return ""
    return (
        f"that is a scatter of {scatter:.2g} {unit}, which the uncertainties include;"
        f" below {most:.2g} {unit} it does not matter for navigation"
    )
