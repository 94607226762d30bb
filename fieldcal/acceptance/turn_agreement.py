"""Whether the turns measured by the gyroscopes agree with the positions.

A turn of one radian may miss the next position by the uncertainty of the scale factor
that the grade allows, in rad. If turns miss by more, and not by chance, the calibration
does not describe them: outputs are exchanged, the range is too small, or the stated
angles are wrong.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.acceptance.check import Check
from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.core.probability import chi2_tail


def turn_disagreement(calibration: Calibration, limits: GradeLimits) -> str:
    """Sentence with the remedy if turns contradict the positions; else empty."""
    turns = calibration.info.get("turns", {})
    scatter, dof = float(turns.get("scatter_rad", 0.0)), int(turns.get("dof", 0))
    chance = chi2_tail(float(turns.get("chi2", 0.0)), dof) if dof > 0 else 1.0
    if chance >= limits.fit_chance or scatter <= limits.gyr_scale_sigma:
        return ""
    return (
        "the turns of the gyroscopes miss the positions by"
        f" {np.rad2deg(scatter):.2g}° (χ² = {turns['chi2']:.0f} with {dof} degrees of"
        f" freedom), allowed"
        f" {np.rad2deg(limits.gyr_scale_sigma):.2g}°: outputs are exchanged, the range"
        " is too small, or angles in session.toml are wrong; run fieldcal diagnose to"
        " see which"
    )


def turns_agree(calibration: Calibration, checks: Sequence[Check]) -> bool:
    """Whether turns were measured that might have missed, and `checks` none that did.

    A turn by a wrong angle, or between other positions, is seen by the gyroscopes.
    """
    turns = calibration.info.get("turns", {})
    return int(turns.get("dof", 0)) > 0 and not checks


def check_turns(calibration: Calibration, limits: GradeLimits) -> list[Check]:
    """Check whether the turns measured by the gyroscopes agree with the positions."""
    apart = turn_disagreement(calibration, limits)
    return [Check("turns", False, apart)] if apart else []
