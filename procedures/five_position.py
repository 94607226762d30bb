"""Five positions: the tilt of the base as well, so that it need not be level.

The joint estimate of all parameters from the same averages is several times better
than the equations one after the other. Source: Avrutov and Pozniak 2023, (15)-(34).
"""

from __future__ import annotations

from fieldcal.calibration import Calibration
from fieldcal.description import Description
from fieldcal.observing import observations
from fieldcal.plan import Plan
from fieldcal.positions import FIVE, Position
from fieldcal.procedures.holding import hold_each, with_left_out
from fieldcal.solve import solve

POSITIONS: tuple[Position, ...] = FIVE


def plan(
    about: Description, seconds: float = 30.0, sigma: float | None = None
) -> Plan[Calibration]:
    """Hold the positions of `about` for `seconds` each and solve."""
    held = yield from hold_each(about.positions, seconds, sigma)
    seen = observations(about, list(held.values()), list(held))
    found = solve(seen, level_sigma_deg=about.level_deg)
    return with_left_out(found, about.positions, held)
