"""Two positions: bias and scale factor of the accelerometers, bias of the gyroscopes.

Home, then both joints turned by small angles. The base must be level: its tilt enters
the biases (0.17 m/s^2 for one degree), and two positions cannot determine it. The level
of the base must be stated, and is part of every uncertainty.
Source: Avrutov and Pozniak 2023, (11)-(14), (36), (45)-(48).
"""

from __future__ import annotations

from fieldcal.calibration import Calibration
from fieldcal.core.positions import TWO_POSITIONS, Position
from fieldcal.evaluation.observations import angle_setting, build_observations
from fieldcal.planning.holding import hold_each, with_skipped_positions
from fieldcal.planning.steps import Plan
from fieldcal.session.description import Description
from fieldcal.session.factory import factory_errors
from fieldcal.solve import solve

POSITIONS: tuple[Position, ...] = TWO_POSITIONS

COUNT = 2
"""Number of positions that its method takes."""


def plan(
    about: Description, seconds: float = 30.0, sigma: float | None = None
) -> Plan[Calibration]:
    """Hold the positions of `about` for `seconds` each and solve."""
    held = yield from hold_each(about.positions, seconds, sigma)
    seen = build_observations(about, list(held.values()), list(held))
    found = solve(
        seen,
        method="two_position",
        level_sigma_deg=about.level_deg,
        angle_sigma_deg=angle_setting(about),
        factory=factory_errors(about),
    )
    return with_skipped_positions(found, about.positions, held)
