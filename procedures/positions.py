"""Positions of the user's choice: estimates jointly all parameters that they determine.

Parameters that they do not determine are named in the warnings.
"""

from __future__ import annotations

from fieldcal.calibration import Calibration
from fieldcal.core.positions import WIDE_POSITIONS, Position
from fieldcal.evaluation.observations import angle_setting, build_observations
from fieldcal.planning.holding import hold_each, with_skipped_positions
from fieldcal.planning.steps import Plan
from fieldcal.session.description import Description
from fieldcal.session.factory import factory_errors
from fieldcal.solve import solve

POSITIONS: tuple[Position, ...] = WIDE_POSITIONS


def plan(
    about: Description, seconds: float = 30.0, sigma: float | None = None
) -> Plan[Calibration]:
    """Hold the positions of `about` for `seconds` each and solve."""
    held = yield from hold_each(about.positions, seconds, sigma)
    seen = build_observations(about, list(held.values()), list(held))
    found = solve(
        seen,
        level_sigma_deg=about.level_deg,
        angle_sigma_deg=angle_setting(about),
        factory=factory_errors(about),
    )
    return with_skipped_positions(found, about.positions, held)
