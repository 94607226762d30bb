"""Whether the tilt of the base is known; some sets of positions do not determine it.

A base that is tilted by t about a level axis changes a bias by up to g t, 0.17 m/s^2
for one degree. Five positions determine the tilt. Two cannot distinguish it from a
bias: the tilt is then known as well as the level was stated, which is part of every
uncertainty, or it is not known.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fieldcal.acceptance.check import Check
from fieldcal.calibration import Calibration
from fieldcal.core.probability import chi2_tail
from fieldcal.core.sentences import degrees_of_freedom
from fieldcal.session.description import Description

BLIND = 2
"""Number of positions with known angles that cannot distinguish a tilt from a bias."""


DOUBTED = 0.01
"""Probability of the tilt that the positions show, below which a stated level is not
accepted. The error of a bias, in its sigmas, is then half as large again as that of the
tilt. Without the statement the tilt is estimated."""


OTHER_TILT = {
    "angle_offset": "a tilt of the base",
    "base_tilt": "offsets of the joints",
}
"""The other kind of tilt, by the kind that a result contains."""


def tilt_is_found(calibration: Calibration) -> bool:
    """Whether the tilt is a parameter of the result, or has no effect on it."""
    tilted = {"angle_offset", "base_tilt"} & set(calibration.groups)
    return bool(tilted) or calibration.method == "scalar"


def level_missing_warning(about: Description) -> str:
    """Sentence about a base whose level is not stated, with the remedy."""
    bias = about.gravity * np.deg2rad(1.0)
    return (
        "these positions do not show how level the base is, and a tilt of 1° changes a"
        f" bias by {bias:.2f} m/s²: state how level it is (--level 0.01, in degrees,"
        " 1σ; fieldcal run --resume and fieldcal solve accept it afterwards), or take"
        " five positions"
    )


def level_warning_before_run(about: Description) -> str:
    """Warning before a run that would end in NO-GO for it; empty if not needed."""
    known = sum(position.oriented for position in about.positions)
    return (
        level_missing_warning(about)
        if known <= BLIND and about.level_deg is None
        else ""
    )


def check_level(calibration: Calibration, about: Description) -> list[Check]:
    """Check whether the level of the base is known: an unknown tilt acts as a bias.

    A stated level that the positions contradict fails.
    """
    shown = calibration.info.get("tilt_shown")
    level = calibration.info.get("level_sigma_deg")
    if shown and chi2_tail(shown["chi2"], shown["dof"]) < DOUBTED:
        says = (
            f"the base is level to ± {level:.2g}°, as stated, but the positions show a"
            f" tilt of {shown['tilt_deg']:.2g}° (χ² = {shown['chi2']:.0f} with"
            f" {degrees_of_freedom(shown['dof'])}): level the base and record again, or"
            " leave the statement out (--level, level_deg), and the tilt is estimated"
        )
        return [Check("level", False, says)]
    if tilt_is_found(calibration) or "acc_bias" not in calibration.groups:
        return list(_other_tilt_checks(calibration))
    if level is None:
        return [Check("level", False, level_missing_warning(about))]
    says = f"the base is level to ± {level:.2g}°, as stated, and each ± includes this"
    return [Check("level", True, says)]


def _other_tilt_checks(calibration: Calibration) -> Iterator[Check]:
    """Report the assumed size of the other kind of tilt."""
    kinds = [OTHER_TILT[group] for group in calibration.groups if group in OTHER_TILT]
    if kinds and (off := calibration.info.get("beside_tilt_sigma_deg")):
        says = f"each ± includes {kinds[0]} of 0 ± {off:.2g}°, beside the tilt found"
        yield Check("level", None, says)
