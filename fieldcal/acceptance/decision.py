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

from fieldcal.acceptance.agreement import (
    FIT,
    check_fit,
    check_gyroscopes,
    leaves_a_check,
)
from fieldcal.acceptance.angles import ANGLES, check_angles
from fieldcal.acceptance.change import check_change
from fieldcal.acceptance.check import Check
from fieldcal.acceptance.common_rotation import check_common_rotation
from fieldcal.acceptance.conditions import check_link, check_temperature
from fieldcal.acceptance.factory import check_factory_errors
from fieldcal.acceptance.growth import TIMES, NavigationErrors, navigation_errors
from fieldcal.acceptance.jump import check_jump
from fieldcal.acceptance.level import check_level
from fieldcal.acceptance.remedy import Remedy, cheapest_remedy
from fieldcal.acceptance.site import check_site
from fieldcal.acceptance.turn_agreement import check_turns, turns_agree
from fieldcal.acceptance.uncertainty import UNCERTAINTY, check_uncertainty
from fieldcal.acceptance.verification import Verification, check_verification
from fieldcal.acceptance.witnesses import check_doubtful_position
from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.session.description import Description
from fieldcal.windows import Average


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
    verification = check_verification(circumstances.verification, limits)
    change = check_change(
        calibration, limits, circumstances.family, circumstances.temperature_sigma,
        str(about.device.get("serial", "")),
    )  # fmt: skip
    turns = check_turns(calibration, limits)
    witnesses = [
        what
        for what, confirms in (
            ("the turns that the gyroscopes measured", turns_agree(calibration, turns)),
            ("the position that was not fitted", verification.ok is True),
            ("earlier calibrations", bool(change) and all(c.ok for c in change)),
        )
        if confirms
    ]
    checks = [
        check_fit(calibration, limits, witnesses),
        *_examination_checks(calibration),
        *check_doubtful_position(calibration, verification.ok is True),
        *check_gyroscopes(calibration, limits),
        *turns,
        *check_jump(calibration, limits),
        *check_angles(
            calibration, about, limits, circumstances.verification, circumstances.family
        ),
        *check_factory_errors(calibration, about, limits),
        *check_common_rotation(calibration, limits),
        *check_level(calibration, about),
        *check_uncertainty(calibration, about, limits, circumstances.windows),
        *check_site(calibration, about),
        *change,
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

    More positions of the same fixture do not check its angles, nor do they make a
    wrong description right.
    """
    windows = circumstances.windows
    if not windows or calibration.info.get("misdescribed"):
        return None
    if any(c.name == ANGLES and c.ok is False for c in checks):
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
    unchecked = calibration.good and FIT in others and not leaves_a_check(calibration)
    if unchecked:
        others.remove(FIT)
    numbers = circumstances.position_numbers or range(len(about.positions))
    length = float(np.ceil(seconds))
    return cheapest_remedy(
        calibration, about, numbers, limits, failed, sigma, length, others, unchecked
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
