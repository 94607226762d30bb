"""Whether the gyroscopes' turns lead where the positions are.

A turn of a radian closes within the scale factor's uncertainty that the grade allows,
in rad. Turns that close worse, and not by chance, have something in them that the
calibration does not: outputs exchanged, a range that is too small, angles that are not
what they are said to be.
"""

from __future__ import annotations

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.core.chances import chi2_tail


def turns_disagree(found: Calibration, limits: GradeLimits) -> str:
    """Sentence where turns do not close, with the remedy; else empty."""
    turns = found.info.get("turns", {})
    scatter, dof = float(turns.get("scatter_rad", 0.0)), int(turns.get("dof", 0))
    chance = chi2_tail(float(turns.get("chi2", 0.0)), dof) if dof > 0 else 1.0
    if chance >= limits.fit_chance or scatter <= limits.gyr_scale_sigma:
        return ""
    return (
        f"the gyroscopes' turns miss the positions by {np.rad2deg(scatter):.2g}° (χ² ="
        f" {turns['chi2']:.0f} with {dof} degrees of freedom), allowed"
        f" {np.rad2deg(limits.gyr_scale_sigma):.2g}°: outputs are exchanged, the range"
        " is too small, or the angles are others than session.toml says; fieldcal"
        " diagnose says what fits"
    )
