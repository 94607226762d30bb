"""What procedures share: holding positions one after the other, again if it moved."""

from __future__ import annotations

from collections.abc import Sequence

from fieldcal.errors import CalibrationFailed, Moved
from fieldcal.plan import Plan, hold, note
from fieldcal.positions import Position
from fieldcal.windows import Average

TRIES = 5
"""Windows begun in a position before the procedure gives up."""


def hold_all(
    positions: Sequence[Position], seconds: float, sigma: float | None = None
) -> Plan[tuple[Average, ...]]:
    """Hold every position for `seconds` of device time; the averages in order."""
    averages = []
    for index, position in enumerate(positions):
        averages.append((yield from _steady(index, position, seconds, sigma)))
    return tuple(averages)


def _steady(
    index: int, position: Position, seconds: float, sigma: float | None
) -> Plan[Average]:
    for _ in range(TRIES):
        try:
            return (yield from hold(index, position, seconds, sigma))
        except Moved as moved:
            yield from note(f"{moved}; hold still, the window starts again")
    raise CalibrationFailed(
        f"{position.name}: no window of {seconds:g} s without a disturbance in {TRIES}"
        " tries; fix the device better, shelter it from the wind, then start again"
    )
