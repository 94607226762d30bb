"""Whether the means of the windows agree with each other, in the calibration's fit.

    P(chi2 or more) >= the smallest chance that the grade allows

A misfit too small to matter for navigation passes (`harmless`).
"""

from __future__ import annotations

import numpy as np

from fieldcal.acceptance.check import Check
from fieldcal.acceptance.harmless import harmless_scatter_note
from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.core.probability import chi2_tail


def check_fit(calibration: Calibration, limits: GradeLimits) -> Check:
    """Check the agreement of the positions; NO-GO if the estimate is bad."""
    if not calibration.good:
        why = calibration.warnings[0] if calibration.warnings else "see the fit"
        return Check("fit", False, f"the estimate is bad: {why}")
    if calibration.dof <= 0 or not np.isfinite(calibration.chi2):
        return Check("fit", None, "no degree of freedom is left to check the fit")
    return _agreement_check(
        "fit", "positions", calibration.chi2, calibration.dof, calibration, limits
    )


def check_gyroscopes(calibration: Calibration, limits: GradeLimits) -> list[Check]:
    """Check the agreement of the gyroscopes' means, if accelerometers were measured."""
    gyr = calibration.info.get("gyroscopes", {})
    chi2, dof = float(gyr.get("chi2", 0.0)), int(gyr.get("dof", 0))
    if dof <= 0 or "acc_bias" not in calibration.groups:
        return []
    what = "gyroscopes at rest"
    return [_agreement_check("gyroscopes", what, chi2, dof, calibration, limits, "gyr")]


def _agreement_check(
    name: str,
    what: str,
    chi2: float,
    dof: int,
    calibration: Calibration,
    limits: GradeLimits,
    sensor: str = "acc",
) -> Check:
    """Check the agreement of the means of a sensor; a harmless scatter passes."""
    chance = chi2_tail(chi2, dof)
    agree = chance >= limits.fit_chance
    word = "agree" if agree else "do not agree"
    says = (
        f"the {what} {word} with each other: χ² = {chi2:.1f} with"
        f" {dof} degrees of freedom, probability {chance:.2g}, required"
        f" {limits.fit_chance:.2g}"
    )
    if not agree and (small := harmless_scatter_note(calibration, limits, sensor)):
        says += f"; {small}"
        agree = True
    return Check(name, agree, says, chance, limits.fit_chance, "1")
