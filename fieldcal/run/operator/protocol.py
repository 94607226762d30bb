"""Interface between the engine and the operator: views to show, wishes to carry out."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.drivers.driver import Driver, LinkHealth
from fieldcal.planning.steps import Hold
from fieldcal.run.position_check import PositionCheck
from fieldcal.run.wait_reason import WaitReason, WaitState
from fieldcal.run.waiting import PositionWait
from fieldcal.windows import Average, PiecedWindow

Phase = Literal["turning", "averaging", "taken", "silent"]
"""What the engine waits for: to be in place, the window, the next step, samples."""

Wish = Literal["confirm", "repeat", "skip", "stop", "wait"]
"""What an operator may want: a key, or a mover that is still at work (wait)."""

UNKNOWN = np.full(6, np.nan)
"""Standard error before there is one."""

NOTHING, TAKEN_BEFORE = WaitReason(), WaitReason(WaitState.TAKEN_BEFORE)


@dataclass(frozen=True, slots=True)
class OperatorView:
    """State of the run for the display.

    Attributes
    ----------
    phase : what the engine waits for
    hold : the step being carried out
    arrival : where the device is, None while it is not known
    stillness : present motion over the limit for rest; below 1 is still
    elapsed : s of device time averaged so far
    sigma : (6,) standard error reached so far, nan before there is one
    reason : why it waits
    rate_hz : samples a second of device time
    temperature : deg C, nan where unknown
    health : of the link
    left_out : numbers of the positions that the operator left out

    """

    phase: Phase
    hold: Hold
    arrival: PositionCheck | None
    stillness: float
    elapsed: float
    sigma: Array
    reason: WaitReason
    rate_hz: float
    temperature: float
    health: LinkHealth
    left_out: frozenset[int] = frozenset()


class Operator(Protocol):
    """Moves the device: a person at a console, or a script with a mover."""

    def place(self, hold: Hold) -> None:
        """Ask for a position, or begin to turn there; return at once."""

    def tell(self, text: str) -> None:
        """Show a sentence that must not be missed."""

    def alarm(self, reason: WaitReason, waited: float = 0.0) -> None:
        """Call the operator: the reason that is shown needs something to be done.

        `waited` is the time since the position was asked for if this is a reminder, s.
        """

    def show(self, view: OperatorView) -> None:
        """Show the state; called for every block, must not take long."""

    def wish(self) -> Wish | None:
        """Wish of the operator since the last call; called for every block."""


class Display:
    """Shows the state of the engine to an operator, block by block.

    Parameters
    ----------
    operator : who sees it
    driver : the device, whose health is shown
    left_out : numbers of the positions that were left out, which may change

    """

    def __init__(
        self, operator: Operator, driver: Driver, left_out: Set[int] = frozenset()
    ) -> None:
        self._operator, self._driver, self._left_out = operator, driver, left_out
        self._rate = self._temperature = np.nan

    def note_samples(self, block: Block) -> None:
        """Store rate and temperature of the latest samples."""
        if len(block) > 1:
            self._rate = (len(block) - 1) / (block.t[-1] - block.t[0])
        self._temperature = float(block.temperature[-1])

    def show_turning(
        self, hold: Hold, waiting: PositionWait, reason: WaitReason
    ) -> None:
        """Show where the device is on its way, and what is waited for."""
        self._show("turning", hold, waiting.where, waiting.meter, reason=reason)

    def show_averaging(self, hold: Hold, window: PiecedWindow) -> None:
        """Show the progress of a window."""
        self._show(
            "averaging", hold, None, window.motion_now, window.elapsed, window.sigma
        )

    def show_taken(self, hold: Hold, window: PiecedWindow) -> None:
        """Show the standard error that a window has reached."""
        self._show("taken", hold, None, window.motion_now, window.elapsed, window.sigma)

    def show_taken_before(self, hold: Hold, average: Average) -> None:
        """Show the standard error of a position that was taken earlier."""
        self._show("taken", hold, sigma=average.sigma, reason=TAKEN_BEFORE)

    def show_silence(self, hold: Hold, reason: WaitReason) -> None:
        """Show that no samples arrive."""
        self._show("silent", hold, reason=reason)

    def _show(
        self,
        phase: Phase,
        hold: Hold,
        arrival: PositionCheck | None = None,
        stillness: float = np.nan,
        elapsed: float = 0.0,
        sigma: Array = UNKNOWN,
        reason: WaitReason = NOTHING,
    ) -> None:
        link = (self._rate, self._temperature, self._driver.health)
        out = frozenset(self._left_out)
        view = OperatorView(
            phase, hold, arrival, stillness, elapsed, sigma, reason, *link, out
        )
        self._operator.show(view)
