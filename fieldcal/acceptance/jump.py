"""Whether biases jump within a session by more than from run to run.

A device that was switched off meanwhile has the biases of another run. With the
standard deviation s_r from run to run and the uncertainty s of the jump,

    chi2 = sum over biases of jump^2 / (2 s_r^2 + s^2),   P(chi2 or more)          (1)

A larger jump means another device, or damage: the scale factors have then changed as
well, although the fit assumes them to be the same before and after the jump.
"""

from __future__ import annotations

from fieldcal.acceptance.check import Check
from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.calibration.names import group_of
from fieldcal.core.probability import chi2_tail


def bias_jump_warning(calibration: Calibration, limits: GradeLimits) -> str:
    """Sentence if biases jump by more than from run to run; else empty."""
    jump = calibration.info.get("jump")
    if not jump:
        return ""
    far = {}
    for name, (value, sigma) in jump["bias"].items():
        repeat = limits.repeat(group_of(name))
        if repeat is not None:
            far[name] = value**2 / (2.0 * repeat**2 + sigma**2)  # (1)
    chi2 = sum(far.values())
    if not far or chi2_tail(chi2, len(far)) >= limits.fit_chance:
        return ""
    name = max(far, key=lambda n: far[n])
    value, sigma = jump["bias"][name]
    unit = "m/s²" if name.startswith("acc") else "rad/s"
    return (
        f"at {jump['at_s']:.0f} s of device time the biases jump by more than those of"
        f" one device do from run to run ({name} by {value:+.2g} ± {sigma:.1g} {unit},"
        f" χ² = {chi2:.0f} of {len(far)} biases): another device was put in its place,"
        " or it was damaged; record all positions of one device"
    )


def check_jump(calibration: Calibration, limits: GradeLimits) -> list[Check]:
    """Check whether biases jump as if another device had been recorded."""
    far = bias_jump_warning(calibration, limits)
    return [Check("jump", False, far)] if far else []
