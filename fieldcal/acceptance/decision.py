"""GO or NO-GO: a calibration against the limits of its grade, with reasons.

Each check states in a sentence what was measured and what is allowed. A check that
could not be made, for lack of a thermometer or of earlier calibrations, is reported and
is not a reason for NO-GO. The history does not influence the calibration.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fieldcal.acceptance.angles import (
    ANGLES_REMEDY,
    angles_are_stated,
    unnoticed_angle_error,
)
from fieldcal.acceptance.change import check_change
from fieldcal.acceptance.check import Check
from fieldcal.acceptance.conditions import check_link, check_temperature
from fieldcal.acceptance.factory import check_factory_errors
from fieldcal.acceptance.growth import TIMES, NavigationErrors, navigation_errors
from fieldcal.acceptance.harmless import harmless_scatter_note
from fieldcal.acceptance.jump import bias_jump_warning
from fieldcal.acceptance.level import check_level
from fieldcal.acceptance.remedy import Remedy, cheapest_remedy
from fieldcal.acceptance.site import (
    gravity_contradiction,
    gravity_missing_warning,
    latitude_missing_warning,
)
from fieldcal.acceptance.turn_agreement import turn_disagreement
from fieldcal.acceptance.uncertainty import UNCERTAINTY, check_uncertainty
from fieldcal.acceptance.verification import Verification
from fieldcal.acceptance.witnesses import (
    has_witnesses,
    rejected_positions,
    witness_sentence,
)
from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.core.escaping import escape_line
from fieldcal.core.probability import chi2_tail
from fieldcal.session.description import Description
from fieldcal.solve.doubtful_position import DoubtfulPosition
from fieldcal.windows import Average

ANGLES = "angles"
"""Name of the check whether wrong angles would be noticed."""


@dataclass(frozen=True, slots=True)
class Decision:
    """All checks, the navigation errors to expect, and a remedy after NO-GO."""

    checks: tuple[Check, ...]
    navigation_errors: tuple[NavigationErrors, ...]
    remedy: Remedy | None = None

    @property
    def go(self) -> bool:
        """Whether no check failed."""
        return all(check.ok is not False for check in self.checks)

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why it is NO-GO; empty where it is GO."""
        return tuple(check.says for check in self.checks if check.ok is False)


@dataclass(frozen=True, slots=True)
class Circumstances:
    """Facts about the run that the calibration does not contain.

    Attributes
    ----------
    temperatures : mean of each window, deg C, nan where unknown
    link : counts of `driver.LinkHealth`; empty where unknown
    verification : residual of a position that was not fitted; None without one
    family : earlier calibrations of the device at this temperature, oldest first; None
        without a history
    temperature_sigma : uncertainty added to these for the change of temperature
    doubts : sentences about events of the run, each a reason for NO-GO
    windows : windows of the calibration
    position_numbers : of the positions that have a window, from 0; empty if all have

    """

    temperatures: Sequence[float] = ()
    link: Mapping[str, int] | None = None
    verification: Verification | None = None
    family: Sequence[Calibration] | None = None
    temperature_sigma: Mapping[str, float] = field(default_factory=dict)
    doubts: Sequence[str] = ()
    windows: Sequence[Average] = ()
    position_numbers: Sequence[int] = ()


def decide(
    calibration: Calibration,
    about: Description,
    limits: GradeLimits,
    circumstances: Circumstances,
) -> Decision:
    """Check a calibration against limits."""
    verification = _verification_check(circumstances.verification, limits)
    checks = [
        _fit_check(calibration, limits),
        *_examination_checks(calibration),
        *_doubtful_position_checks(calibration, verification.ok is True),
        *_gyroscope_checks(calibration, limits),
        *_turn_checks(calibration, limits),
        *_jump_checks(calibration, limits),
        *_angle_checks(calibration, about, limits, circumstances),
        *check_factory_errors(calibration, about, limits),
        *check_level(calibration, about),
        *check_uncertainty(calibration, about, limits, circumstances.windows),
        *_site_checks(calibration, about),
        *check_change(
            calibration, limits, circumstances.family, circumstances.temperature_sigma
        ),
        verification,
        *check_temperature(np.asarray(circumstances.temperatures, float), limits),
        *check_link(circumstances.link, limits),
        *(Check("the run", False, doubt) for doubt in circumstances.doubts),
    ]
    g, mounting = about.gravity, about.mounting
    grown = tuple(
        navigation_errors(calibration, g, mounting, seconds) for seconds in TIMES
    )
    made = Decision(tuple(checks), grown)
    return (
        made
        if made.go
        else replace(
            made, remedy=_find_remedy(calibration, about, limits, circumstances, checks)
        )
    )


def _find_remedy(
    calibration: Calibration,
    about: Description,
    limits: GradeLimits,
    circumstances: Circumstances,
    checks: Sequence[Check],
) -> Remedy | None:
    """The cheapest remedy; None if it cannot be predicted from the windows.

    More positions of the same fixture do not check its angles.
    """
    windows = circumstances.windows
    if not windows or any(c.name == ANGLES and c.ok is False for c in checks):
        return None
    known = [w.sigma[:3][np.isfinite(w.sigma[:3])] for w in windows]
    sigma = float(np.median([s.max() for s in known if len(s)] or [np.nan]))
    seconds = float(np.median([w.end - w.start for w in windows]))
    if not (np.isfinite(sigma) and sigma > 0):
        return None
    failed = [
        check.name.removesuffix(UNCERTAINTY)
        for check in checks
        if check.ok is False and check.name.endswith(UNCERTAINTY)
    ]
    others = [c.name for c in checks if c.ok is False]
    others = [name for name in others if not name.endswith(UNCERTAINTY)]
    numbers = circumstances.position_numbers or range(len(about.positions))
    length = float(np.ceil(seconds))
    return cheapest_remedy(
        calibration, about, numbers, limits, failed, sigma, length, others
    )


def with_decision(calibration: Calibration, made: Decision) -> Calibration:
    """The calibration with the decision in its `info`."""
    decision: dict[str, Any] = {
        "go": made.go,
        "reasons": list(made.reasons),
        "checks": [check.to_json() for check in made.checks],
    }
    if made.remedy is not None:
        decision["remedy"] = made.remedy.to_json()
    expectation = [each.to_json() for each in made.navigation_errors]
    more = {"decision": decision, "expectation": expectation}
    return replace(calibration, info={**calibration.info, **more})


def _fit_check(calibration: Calibration, limits: GradeLimits) -> Check:
    if not calibration.good:
        return Check(
            "fit", False, "the estimate is bad: " + _first_warning(calibration)
        )
    if calibration.dof <= 0 or not np.isfinite(calibration.chi2):
        return Check("fit", None, "no degree of freedom is left to check the fit")
    return _agreement_check(
        "fit", "positions", calibration.chi2, calibration.dof, calibration, limits
    )


def _gyroscope_checks(calibration: Calibration, limits: GradeLimits) -> list[Check]:
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


def _examination_checks(calibration: Calibration) -> list[Check]:
    """NO-GO if only means were used: samples and turns might contradict them."""
    why = calibration.info.get("unexamined")
    if not why:
        return []
    says = (
        f"neither samples nor turns could be examined, which might contradict the"
        f" means of the windows: {why}"
    )
    return [Check("recording", False, says)]


def _doubtful_position_checks(calibration: Calibration, verified: bool) -> list[Check]:
    """Report a doubtful position; NO-GO if too few others confirm the result."""
    doubt = DoubtfulPosition.from_json(calibration.info.get("doubtful_position"))
    checks = [Check("positions", None, doubt.sentence)] if doubt else []
    if verified or not rejected_positions(calibration):
        return checks
    return [
        *checks,
        Check("witnesses", has_witnesses(calibration), witness_sentence(calibration)),
    ]


def _turn_checks(calibration: Calibration, limits: GradeLimits) -> list[Check]:
    """Check whether the turns measured by the gyroscopes agree with the positions."""
    apart = turn_disagreement(calibration, limits)
    return [Check("turns", False, apart)] if apart else []


def _jump_checks(calibration: Calibration, limits: GradeLimits) -> list[Check]:
    """Check whether biases jump as if another device had been recorded."""
    far = bias_jump_warning(calibration, limits)
    return [Check("jump", False, far)] if far else []


def _angle_checks(
    calibration: Calibration,
    about: Description,
    limits: GradeLimits,
    circumstances: Circumstances,
) -> list[Check]:
    """Check whether wrong angles would be noticed."""
    given = (circumstances.verification, circumstances.family)
    if about.angles_from:
        says = f"the angles are certified by {escape_line(about.angles_from)}"
        return [Check(ANGLES, True, says)]
    unseen = unnoticed_angle_error(calibration, about, limits, *given)
    if not unseen:
        return []
    if not angles_are_stated(calibration, about, limits):
        return [Check(ANGLES, False, f"{unseen}; {ANGLES_REMEDY}")]
    said = calibration.info.get("angle_sigma_deg") or 0.0
    shown = "angles_stated_deg" in calibration.info
    how = "as the recording shows" if shown else "as stated"
    relied = f"the result relies on angles set to ± {said:.2g}°, {how}: {unseen}"
    return [Check(ANGLES, None, relied)]


def _first_warning(calibration: Calibration) -> str:
    return calibration.warnings[0] if calibration.warnings else "see the fit"


def _site_checks(calibration: Calibration, about: Description) -> list[Check]:
    """Check whether what calibrates the sensors is known: gravity, the Earth's rate."""
    wrong = ""
    if "acc_scale" in calibration.groups:
        wrong = gravity_missing_warning(about) or gravity_contradiction(about)
    if not wrong and "gyr_bias" in calibration.groups:
        wrong = latitude_missing_warning(about)
    return [Check("site", False, wrong)] if wrong else []


def _verification_check(
    verification: Verification | None, limits: GradeLimits
) -> Check:
    if verification is None:
        says = "no verification position was recorded (--verify)"
        return Check("verification", None, says)
    if not verification.measured:
        says = (
            f"{verification.position.name}, which was to verify the result, could not"
            f" be measured ({verification.reason}): record it again"
        )
        return Check("verification", False, says)
    far = verification.residual_size > limits.verification_residual
    odd = verification.chance < limits.verification_chance
    sigma = float(np.linalg.norm(verification.sigma))
    says = (
        f"at {verification.position.name}, which was not fitted, the accelerometers"
        f" differ from the prediction by {verification.residual_size:.2g} ±"
        f" {sigma:.2g} m/s², allowed {limits.verification_residual:.2g} m/s²"
    )
    if odd:
        says += (
            "; the ± of the calibration does not explain this difference (probability"
            f" {verification.chance:.1g})"
        )
    limit = limits.verification_residual
    return Check(
        "verification",
        not (far or odd),
        says,
        verification.residual_size,
        limit,
        "m/s^2",
    )
