"""Whether anything would contradict wrong angles.

A calibration by angles that somebody set is as good as these. A mistake that shows by l
and moves a parameter by d, of its largest size (`solve.reliability`), is harmful where
it is large enough to move the parameter by five of its uncertainties, s, and too small
to be seen. If every size u up to the largest, 1, is as likely as another, that is so in

    part = max(0, min(1, L / l) - 5 s / d)                                         (1)

of all cases, L being what shows. Further witnesses add to l: a position that was not
fitted, and earlier calibrations of the device. Whoever says how well the angles are
set, or names the certificate of the fixture, is taken at that word, and the decision
says that it relies on it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.acceptance.verification import Verification
from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.calibration.names import group_of
from fieldcal.history.family import expected
from fieldcal.model import thresholds
from fieldcal.session.description import Description
from fieldcal.solve.reliability import WrongAngles

SHOWN = 5.0
"""L of (1): with ten degrees of freedom, chi-squared of 25 above its mean is rarer than
1e-4, which is NO-GO."""

REMEDY = (
    "say how well they are set (--angles, or [site] angle_setting_deg in session.toml),"
    " or let something that needs no angle bear witness: three or more other faces"
    " (each a [[position]] without angles, gravity is known), or a position to verify"
    " in which all axes feel gravity (--verify, [verification] alpha_deg = -135,"
    " beta_deg = 45)"
)

UNSEEN = 0.1
"""Part of the mistakes of a kind that may be harmful and unseen."""

VIRTUAL = "virtual"
"""The mover whose angles are no one's statement: it is told them by us."""


def unwitnessed(
    found: Calibration,
    about: Description,
    limits: GradeLimits,
    verification: Verification | None,
    family: Sequence[Calibration] | None,
) -> str:
    """Sentence where wrong angles would go unseen; else empty."""
    if about.angles_from or _told(about):
        return ""
    worst, part, most, sigmas = None, UNSEEN, "", 0.0
    for each in found.info.get("wrong_angles", ()):
        wrong = WrongAngles.from_json(each)
        shows = float(
            np.sqrt(
                wrong.shows**2
                + _verified(wrong, verification)
                + _familiar(wrong, found, limits, family)
            )
        )
        off = {
            n: abs(d) / found.uncertainty(n)
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
        f"nothing would contradict wrong angles: {worst.says} could move {most} by up"
        f" to {sigmas:.0f} σ and not be seen"
    )


def stated(found: Calibration, about: Description, limits: GradeLimits) -> bool:
    """Whether somebody said how well the angles are set, in the session or to solve."""
    used = float(found.info.get("angle_sigma_deg") or 0.0)
    return about.angle_setting_deg is not None or used < limits.angle_setting_deg


def _told(about: Description) -> bool:
    """Whether a program sets the angles, and nobody states them."""
    run = about.raw.get("run", {})
    mover = run.get("mover", {}) if isinstance(run, dict) else {}
    return isinstance(mover, dict) and mover.get("kind") == VIRTUAL


def _verified(wrong: WrongAngles, verification: Verification | None) -> float:
    """l^2 that a position adds that was not fitted."""
    return 0.0 if verification is None else verification.shows(wrong)


def _familiar(
    wrong: WrongAngles,
    found: Calibration,
    limits: GradeLimits,
    family: Sequence[Calibration] | None,
) -> float:
    """l^2 that earlier calibrations add: what differs from all of them is seen."""
    seen = [0.0]
    for name, moved in wrong.moves.items():
        earlier = [c for c in family or () if name in c.names]
        repeat = limits.repeat(group_of(name))
        if not earlier or repeat is None:
            continue
        usual = expected(
            np.array([c.value(name) for c in earlier]),
            np.array([c.uncertainty(name) for c in earlier]),
            repeat,
        )
        seen.append((moved / usual.sigma(found.uncertainty(name))) ** 2)
    return max(seen)
