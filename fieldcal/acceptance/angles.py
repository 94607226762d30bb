"""Whether wrong angles would be noticed.

A calibration is only as good as the angles that were set. For each kind of mistake at
its largest size, `solve.reliability` states how well it shows in the fit, l (the root
of the non-centrality of chi-squared), and the shift d of a parameter. A mistake is
harmful if it moves the parameter by more than five standard uncertainties s while its l
is less than L. If all sizes from 0 to the largest are equally likely,

    part = max(0, min(1, L / l) - 5 s / d)                                         (1)

of the mistakes are harmful. A position that was not fitted and earlier calibrations of
the device increase l. If the accuracy of the angles is stated, or a certificate of the
fixture is named, it is believed, and the decision says that it relies on it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fieldcal.acceptance.change import usual_values
from fieldcal.acceptance.check import Check
from fieldcal.acceptance.verification import Verification
from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.calibration.names import group_of
from fieldcal.core.escaping import escape_line
from fieldcal.core.positions import specific_forces
from fieldcal.evaluation.observations import angle_setting
from fieldcal.model import thresholds
from fieldcal.session.description import Description
from fieldcal.solve.reliability import WrongAngles

ANGLES = "angles"
"""Name of the check whether wrong angles would be noticed."""

SHOWN = 5.0
"""L of (1). With ten degrees of freedom, chi-squared of 25 above its mean is rarer than
1e-4, which is NO-GO."""

ANGLES_REMEDY = (
    "state how well the angles are set (--angles, or [site] angle_setting_deg in"
    " session.toml), or record a check that needs no angles: three or more other faces"
    " (each a [[position]] without angles), or a verification position in which all"
    " axes measure gravity (--verify, [verification] alpha_deg = -135, beta_deg = 45)"
)

FACES, UPRIGHT = 3, 0.5
"""Number of faces without angles that check the other angles, and part of g that an
axis must measure to be checked: on small ladders one axis measures a tenth."""

UNSEEN = 0.1
"""Largest accepted part (1) of harmful mistakes of one kind."""

VIRTUAL = "virtual"
"""Mover without a stated uncertainty of angles: its angles are set by this program."""


def unnoticed_angle_error(
    calibration: Calibration,
    about: Description,
    limits: GradeLimits,
    verification: Verification | None,
    family: Sequence[Calibration] | None,
) -> str:
    """Sentence about wrong angles that would not be noticed; else empty."""
    if about.angles_from or _set_by_program(about):
        return ""
    worst, part, most, sigmas = None, UNSEEN, "", 0.0
    for each in calibration.info.get("wrong_angles", ()):
        wrong = WrongAngles.from_json(each)
        shows = float(
            np.sqrt(
                wrong.shows**2
                + _shown_by_verification(wrong, verification)
                + _shown_by_family(wrong, calibration, limits, family)
            )
        )
        off = {
            n: abs(d) / calibration.uncertainty(n)
            for n, d in wrong.moves.items()
            if limits.sigma(group_of(n)) is not None
        }
        if not off:
            continue
        name = max(off, key=lambda n: off[n])
        unseen = min(1.0, SHOWN / max(shows, 1e-9))
        if (harm := unseen - thresholds.MOVED_WRONG / max(off[name], 1e-9)) > part:
            worst, part, most, sigmas = wrong, harm, name, off[name] * unseen
    if worst is None:
        return ""
    return (
        f"wrong angles would not be noticed: {worst.description} could move {most} by"
        f" up to {sigmas:.0f} σ"
    )


def check_angles(
    calibration: Calibration,
    about: Description,
    limits: GradeLimits,
    verification: Verification | None,
    family: Sequence[Calibration] | None,
) -> list[Check]:
    """Check whether wrong angles would be noticed."""
    if about.angles_from:
        says = f"the angles are certified by {escape_line(about.angles_from)}"
        return [Check(ANGLES, True, says)]
    unseen = unnoticed_angle_error(calibration, about, limits, verification, family)
    if not unseen:
        return []
    if not angles_are_stated(calibration, about, limits):
        return [Check(ANGLES, False, f"{unseen}; {ANGLES_REMEDY}")]
    said = calibration.info.get("angle_sigma_deg") or 0.0
    shown = "angles_stated_deg" in calibration.info
    how = "as the recording shows" if shown else "as stated"
    relied = f"the result relies on angles set to ± {said:.2g}°, {how}: {unseen}"
    return [Check(ANGLES, None, relied)]


def angle_error_explaining(calibration: Calibration, off: Mapping[str, float]) -> str:
    """Unnoticed mistake of an angle that could explain a change, in words; else empty.

    Parameters
    ----------
    calibration : the calibration
    off : difference of each parameter from nominal, by full name

    """
    for each in calibration.info.get("wrong_angles", ()):
        wrong = WrongAngles.from_json(each)
        for name, size in off.items():
            most = abs(wrong.moves.get(name, 0.0))
            if size <= most and wrong.shows * size / most < SHOWN:
                return wrong.description
    return ""


def unstated_angles_warning(about: Description) -> str:
    """Warning before a run if the uncertainty of angles is not stated; else empty.

    It is also empty if each axis is to point up or down, or if three faces besides the
    ladder are planned: gravity checks the angles there.
    """
    said = about.angle_setting_deg is not None or about.angles_from
    oriented = [p for p in about.positions if p.oriented]
    faces = len(about.positions) - len(oriented)
    if said or _set_by_program(about) or len(oriented) < 2 or faces >= FACES:
        return ""
    if np.abs(specific_forces(oriented, 1.0)).max(axis=0).min() > UPRIGHT:
        return ""
    return (
        "nobody stated how well the angles are set, and they are taken as set to"
        f" ± {angle_setting(about):g}°, which on so small a ladder is rarely enough for"
        " GO: state it (--angles 0.01, in degrees, 1σ; fieldcal run --resume and"
        " fieldcal solve accept it afterwards)"
    )


def angles_are_stated(
    calibration: Calibration, about: Description, limits: GradeLimits
) -> bool:
    """Whether the uncertainty of angles is stated, in the session or as an option."""
    used = float(calibration.info.get("angle_sigma_deg") or 0.0)
    return about.angle_setting_deg is not None or used < limits.angle_setting_deg


def _set_by_program(about: Description) -> bool:
    """Whether this program sets the angles of a virtual device."""
    run = about.raw.get("run", {})
    mover = run.get("mover", {}) if isinstance(run, dict) else {}
    return isinstance(mover, dict) and mover.get("kind") == VIRTUAL


def _shown_by_verification(
    wrong: WrongAngles, verification: Verification | None
) -> float:
    """Contribution to l^2 of a position that was not fitted."""
    return 0.0 if verification is None else verification.noncentrality(wrong)


def _shown_by_family(
    wrong: WrongAngles,
    calibration: Calibration,
    limits: GradeLimits,
    family: Sequence[Calibration] | None,
) -> float:
    """Contribution to l^2 of earlier calibrations, which would differ from this one."""
    seen = [0.0]
    for name, moved in wrong.moves.items():
        if usual := usual_values(name, limits, family or ()):
            seen.append((moved / usual.sigma(calibration.uncertainty(name))) ** 2)
    return max(seen)
