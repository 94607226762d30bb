"""Whether the means of the windows agree with each other, in the calibration's fit.

    P(chi2 or more) >= the smallest chance that the grade allows

With as many parameters as means there is nothing to agree, and something else has to
confirm the result: turns that the gyroscopes measured, a position that was not fitted,
or earlier calibrations of the device.

A misfit too small to matter for navigation passes (`harmless`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.acceptance.check import Check
from fieldcal.acceptance.harmless import harmless_scatter_note
from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.core.probability import chi2_tail
from fieldcal.core.sentences import degrees_of_freedom, join_words

FIT = "fit"
"""Name of the check whether the positions agree with each other."""

NO_DOF = "no degree of freedom is left to check the fit"
UNWITNESSED = (
    "as many numbers are estimated as the positions measure, so that any of them may be"
    " wrong and nothing would contradict it: record one position more, or one that is"
    " not fitted (--verify)"
)


def check_fit(
    calibration: Calibration, limits: GradeLimits, witnesses: Sequence[str]
) -> Check:
    """Check the agreement of the positions.

    NO-GO if the estimate is bad, or if nothing is left to agree: with as many
    parameters as means any mistake has its own exact solution. `witnesses` are what
    else confirms the result, in words.
    """
    if not calibration.good:
        why = calibration.warnings[0] if calibration.warnings else "see the fit"
        return Check(FIT, False, f"the estimate is bad: {why}")
    if not np.isfinite(calibration.chi2):
        return Check(FIT, None, NO_DOF)
    if not leaves_a_check(calibration):
        if not witnesses:
            return Check(FIT, False, UNWITNESSED)
        return Check(FIT, None, f"{NO_DOF}: only {join_words(witnesses)} confirm it")
    return _agreement_check(
        FIT, "positions", calibration.chi2, calibration.dof, calibration, limits
    )


def leaves_a_check(calibration: Calibration) -> bool:
    """Whether the positions measure more numbers than are estimated."""
    return calibration.dof > 0


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
        f" {degrees_of_freedom(dof)}, probability {chance:.2g}, required"
        f" {limits.fit_chance:.2g}"
    )
    if not agree and (small := harmless_scatter_note(calibration, limits, sensor)):
        says += f"; {small}"
        agree = True
    return Check(name, agree, says, chance, limits.fit_chance, "1")
