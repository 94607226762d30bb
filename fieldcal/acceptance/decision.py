"""GO or NO-GO: a calibration against the limits of its grade, with reasons.

Each check says in a sentence what was measured and what is allowed. A check that could
not be made, without a thermometer or earlier calibrations, is reported and is no reason
for NO-GO. The history is compared with; nothing of it enters the calibration.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fieldcal.acceptance.angles import REMEDY, stated, unwitnessed
from fieldcal.acceptance.change import check_change
from fieldcal.acceptance.check import Check
from fieldcal.acceptance.conditions import check_link, check_temperature
from fieldcal.acceptance.factory import relies_on_factory
from fieldcal.acceptance.growth import TIMES, Growth, growth
from fieldcal.acceptance.harmless import harmless
from fieldcal.acceptance.jump import jumps_too_far
from fieldcal.acceptance.level import check_level
from fieldcal.acceptance.remedy import Remedy, cheapest
from fieldcal.acceptance.site import gravity_contradicted, gravity_unknown
from fieldcal.acceptance.turned import turns_disagree
from fieldcal.acceptance.uncertainty import UNCERTAINTY, check_uncertainty
from fieldcal.acceptance.verification import Verification
from fieldcal.acceptance.witnesses import has_witnesses, left_out, witnesses
from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.core.chances import chi2_tail
from fieldcal.core.positions import Position
from fieldcal.core.shown import one_line
from fieldcal.session.description import Description
from fieldcal.solve.doubt import DoubtfulPosition
from fieldcal.windows import Average

ANGLES = "angles"
"""Name of the check that wrong angles would be noticed."""


@dataclass(frozen=True, slots=True)
class Decision:
    """All checks, and what the calibration means for a navigator."""

    checks: tuple[Check, ...]
    growth: tuple[Growth, ...]
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
    link : counts of `driver.Health`; empty where unknown
    verification : of a position that was not fitted, if one was held
    family : earlier calibrations of the device at this temperature, oldest first; None
        without a history
    warmth : by how much they may differ for having been taken at others, 1 sigma
    doubts : sentences about what happened on the way that make it NO-GO
    windows : that it was made of
    held : positions that have one; empty where all have

    """

    temperatures: Sequence[float] = ()
    link: Mapping[str, int] | None = None
    verification: Verification | None = None
    family: Sequence[Calibration] | None = None
    warmth: Mapping[str, float] = field(default_factory=dict)
    doubts: Sequence[str] = ()
    windows: Sequence[Average] = ()
    held: Sequence[Position] = ()


def decide(
    found: Calibration,
    about: Description,
    limits: GradeLimits,
    circumstances: Circumstances,
) -> Decision:
    """Check a calibration against limits."""
    verification = _verification(circumstances.verification, limits)
    checks = [
        _fit(found, limits),
        *_examined(found),
        *_odd_positions(found, verification.ok is True),
        *_gyroscopes(found, limits),
        *_turns(found, limits),
        *_jump(found, limits),
        *_angles(found, about, limits, circumstances),
        *relies_on_factory(found, about, limits),
        *check_level(found, about),
        *check_uncertainty(found, about, limits, circumstances.windows),
        *_site(found, about),
        *check_change(found, limits, circumstances.family, circumstances.warmth),
        verification,
        *check_temperature(np.asarray(circumstances.temperatures, float), limits),
        *check_link(circumstances.link, limits),
        *(Check("the run", False, doubt) for doubt in circumstances.doubts),
    ]
    g, mounting = about.gravity, about.mounting
    grown = tuple(growth(found, g, mounting, seconds) for seconds in TIMES)
    made = Decision(tuple(checks), grown)
    return (
        made
        if made.go
        else replace(made, remedy=_remedy(found, about, limits, circumstances, checks))
    )


def _remedy(
    found: Calibration,
    about: Description,
    limits: GradeLimits,
    circumstances: Circumstances,
    checks: Sequence[Check],
) -> Remedy | None:
    """The cheapest remedy, where windows tell what one is worth.

    More positions of the same fixture bear no witness to its angles.
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
    length, held = float(np.ceil(seconds)), circumstances.held or about.positions
    return cheapest(found, about, held, limits, failed, sigma, length)


def with_decision(found: Calibration, made: Decision) -> Calibration:
    """The calibration with the decision among its information."""
    decision: dict[str, Any] = {
        "go": made.go,
        "reasons": list(made.reasons),
        "checks": [check.to_json() for check in made.checks],
    }
    if made.remedy is not None:
        decision["remedy"] = made.remedy.to_json()
    expectation = [each.to_json() for each in made.growth]
    more = {"decision": decision, "expectation": expectation}
    return replace(found, info={**found.info, **more})


def _fit(found: Calibration, limits: GradeLimits) -> Check:
    if not found.good:
        return Check("fit", False, "the estimate is bad: " + _first(found))
    if found.dof <= 0 or not np.isfinite(found.chi2):
        return Check("fit", None, "no degree of freedom is left to check the fit")
    return _agreement("fit", "positions", found.chi2, found.dof, found, limits)


def _gyroscopes(found: Calibration, limits: GradeLimits) -> list[Check]:
    """Whether the gyroscopes' means agree, where others measured beside them."""
    gyr = found.info.get("gyroscopes", {})
    chi2, dof = float(gyr.get("chi2", 0.0)), int(gyr.get("dof", 0))
    if dof <= 0 or "acc_bias" not in found.groups:
        return []
    what = "gyroscopes at rest"
    return [_agreement("gyroscopes", what, chi2, dof, found, limits, "gyr")]


def _agreement(
    name: str,
    what: str,
    chi2: float,
    dof: int,
    found: Calibration,
    limits: GradeLimits,
    sensor: str = "acc",
) -> Check:
    """Whether means of a sensor agree, or by how little they do not."""
    chance = chi2_tail(chi2, dof)
    agree = chance >= limits.fit_chance
    word = "agree" if agree else "do not agree"
    says = (
        f"the {what} {word} with each other: χ² = {chi2:.1f} with"
        f" {dof} degrees of freedom, probability {chance:.2g}, required"
        f" {limits.fit_chance:.2g}"
    )
    if not agree and (small := harmless(found, limits, sensor)):
        says += f"; {small}"
        agree = True
    return Check(name, agree, says, chance, limits.fit_chance, "1")


def _examined(found: Calibration) -> list[Check]:
    """No GO by means alone: samples and turns might contradict them."""
    why = found.info.get("unexamined")
    if not why:
        return []
    says = (
        f"neither samples nor turns could be examined, which might contradict the"
        f" means of the windows: {why}"
    )
    return [Check("recording", False, says)]


def _odd_positions(found: Calibration, verified: bool) -> list[Check]:
    """Name a position that does not fit the others; without witnesses it is NO-GO."""
    doubt = DoubtfulPosition.from_json(found.info.get("doubtful_position"))
    checks = [Check("positions", None, doubt.sentence)] if doubt else []
    if verified or not left_out(found):
        return checks
    return [*checks, Check("witnesses", has_witnesses(found), witnesses(found))]


def _turns(found: Calibration, limits: GradeLimits) -> list[Check]:
    """Whether the gyroscopes were turned as the positions say."""
    apart = turns_disagree(found, limits)
    return [Check("turns", False, apart)] if apart else []


def _jump(found: Calibration, limits: GradeLimits) -> list[Check]:
    """Whether it is one device all the time."""
    far = jumps_too_far(found, limits)
    return [Check("jump", False, far)] if far else []


def _angles(
    found: Calibration,
    about: Description,
    limits: GradeLimits,
    circumstances: Circumstances,
) -> list[Check]:
    """Whether wrong angles would be noticed."""
    given = (circumstances.verification, circumstances.family)
    if about.angles_from:
        says = f"the angles are certified by {one_line(about.angles_from)}"
        return [Check(ANGLES, True, says)]
    unseen = unwitnessed(found, about, limits, *given)
    if not unseen:
        return []
    if not stated(found, about, limits):
        return [Check(ANGLES, False, f"{unseen}; {REMEDY}")]
    said = found.info.get("angle_sigma_deg") or 0.0
    shown = "angles_stated_deg" in found.info
    how = "as the recording shows" if shown else "as stated"
    relied = f"the result relies on angles set to ± {said:.2g}°, {how}: {unseen}"
    return [Check(ANGLES, None, relied)]


def _first(found: Calibration) -> str:
    return found.warnings[0] if found.warnings else "see the fit"


def _site(found: Calibration, about: Description) -> list[Check]:
    """Whether gravity is known, which every accelerometer's scale is measured by."""
    if "acc_scale" not in found.groups:
        return []
    wrong = gravity_unknown(about) or gravity_contradicted(about)
    return [Check("site", False, wrong)] if wrong else []


def _verification(verification: Verification | None, limits: GradeLimits) -> Check:
    if verification is None:
        says = "no verification position was recorded (--verify)"
        return Check("verification", None, says)
    far = verification.largest > limits.verification_residual
    odd = verification.chance < limits.verification_chance
    sigma = float(np.linalg.norm(verification.sigma))
    says = (
        f"at {verification.position.name}, which was not fitted, the accelerometers"
        f" differ from the prediction by {verification.largest:.2g} ± {sigma:.2g} m/s²,"
        f" allowed {limits.verification_residual:.2g} m/s²"
    )
    if odd:
        says += (
            "; the ± of the calibration does not explain this difference (probability"
            f" {verification.chance:.1g})"
        )
    limit = limits.verification_residual
    return Check(
        "verification", not (far or odd), says, verification.largest, limit, "m/s^2"
    )
