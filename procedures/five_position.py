"""Five positions: the tilt of the base as well, so that it need not be level.

The joint estimate of all parameters from the same averages is several times better
than the equations one after the other. Source: Avrutov and Pozniak 2023, (15)-(34).
"""

from __future__ import annotations

from fieldcal.core.positions import FIVE_POSITIONS, Position
from fieldcal.procedures.positions import plan

__all__ = ["POSITIONS", "plan"]

POSITIONS: tuple[Position, ...] = FIVE_POSITIONS
