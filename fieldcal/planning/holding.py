"""Steps that procedures share: hold positions in turn, again after a disturbance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

from fieldcal.calibration import Calibration
from fieldcal.core.errors import CalibrationFailed, FieldcalError, Moved, Skipped
from fieldcal.core.positions import Position
from fieldcal.planning.steps import Hold, Plan, hold, note
from fieldcal.windows import Average

R = TypeVar("R")

MAX_TRIES = 5
"""Largest number of windows started in a position."""


def hold_each(
    positions: Sequence[Position], seconds: float, sigma: float | None = None
) -> Plan[dict[int, Average]]:
    """Hold every position; returns the averages by number, without skipped ones."""
    averages = {}
    for index, position in enumerate(positions):
        try:
            averages[index] = yield from hold_until_still(
                index, position, seconds, sigma
            )
        except Skipped as skipped:
            yield from note(str(skipped))
    if not averages:
        raise CalibrationFailed("every position was left out: nothing to calibrate by")
    return averages


def with_own_lengths(plan: Plan[R], lengths: Mapping[int, float]) -> Plan[R]:
    """The plan with windows of a length of their own, s, by number of the position."""
    reply: object = None
    error: FieldcalError | None = None
    while True:
        try:
            step = plan.throw(error) if error else plan.send(reply)
        except StopIteration as done:
            result: R = done.value
            return result
        if isinstance(step, Hold) and step.index in lengths:
            step = replace(step, seconds=lengths[step.index], sigma=None)
        reply, error = None, None
        try:
            reply = yield step
        except FieldcalError as failed:
            error = failed


def with_skipped_positions(
    found: Calibration, positions: Sequence[Position], held: dict[int, Average]
) -> Calibration:
    """The calibration with warnings about positions that were skipped."""
    left = [p.name for i, p in enumerate(positions) if i not in held]
    said = [f"{name} was left out by the operator" for name in left]
    return replace(found, warnings=(*found.warnings, *said))


def hold_until_still(
    index: int,
    position: Position,
    seconds: float,
    sigma: float | None,
    further: int = 0,
) -> Plan[Average]:
    """Hold one position until a window was not disturbed."""
    for _ in range(MAX_TRIES):
        try:
            return (yield from hold(index, position, seconds, sigma, further))
        except Moved as moved:
            yield from note(f"{moved}; hold still, the window starts again")
    raise CalibrationFailed(
        f"{position.name}: no window of {seconds:g} s without a disturbance in"
        f" {MAX_TRIES} tries; fix the device better, shelter it from the wind, then go"
        " on with --resume"
    )
