"""Whether the tilt of the base is known; some sets of positions do not determine it.

A base that is tilted by t about a level axis changes a bias by up to g t, 0.17 m/s^2
for one degree. Five positions determine the tilt. Two cannot distinguish it from a
bias: there it is known to what was stated, which is part of every uncertainty, or it is
not known.
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
        "these positions do not show how level the base is, and a tilt of 1° changes a"
        f" bias by {bias:.2f} m/s²: state how level it is (--level 0.01, in degrees,"
        " 1σ; fieldcal solve accepts it afterwards), or take five positions"
    )


def level_unknown(about: Description) -> str:
    """Warning before a run that will be NO-GO for it; empty if the tilt is known."""
    known = sum(position.oriented for position in about.positions)
    return level_missing(about) if known <= BLIND and about.level_deg is None else ""
