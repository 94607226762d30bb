"""How level the base is: some sets of positions cannot determine it.

A base tilted by t about a level axis moves a bias by up to g t, 0.17 m/s^2 for one
degree. Five positions find the tilt. Two cannot tell it from a bias: there it is known
within what was said of it, which then is part of every uncertainty, or not at all.
"""

from __future__ import annotations

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.session.description import Description

BLIND = 2
"""Positions with known angles that cannot tell a tilt from a bias."""


def tilt_is_found(found: Calibration) -> bool:
    """Whether the tilt is a parameter of the result, or has no effect on it."""
    tilted = {"angle_offset", "base_tilt"} & set(found.groups)
    return bool(tilted) or found.method == "scalar"


def level_missing(about: Description) -> str:
    """Sentence for a base whose level was not stated, with the remedy."""
    bias = about.gravity * np.deg2rad(1.0)
    return (
        "these positions cannot see how level the base is, and 1° moves a bias by"
        f" {bias:.2f} m/s²: say how level it is (--level 0.01, in degrees, 1σ; also to"
        " fieldcal solve, afterwards), or take five positions"
    )


def level_unknown(about: Description) -> str:
    """What to say before a run that will be NO-GO for it; empty where it is known."""
    known = sum(position.oriented for position in about.positions)
    return level_missing(about) if known <= BLIND and about.level_deg is None else ""
