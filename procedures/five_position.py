"""Five positions: also estimates the tilt of the base, which need not be level.

All parameters are estimated jointly, which is several times more precise than the
successive equations of the source. Source: Avrutov and Pozniak 2023, (15)-(34).
"""

from __future__ import annotations

from fieldcal.core.positions import FIVE_POSITIONS, Position
from fieldcal.procedures.positions import plan

__all__ = ["POSITIONS", "plan"]

POSITIONS: tuple[Position, ...] = FIVE_POSITIONS
