"""What the engine shows to whoever moves the device, and what it asks of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

from fieldcal.arrival import Arrival
from fieldcal.driver import Health
from fieldcal.plan import Hold
from fieldcal.samples import Array

Phase = Literal["turning", "averaging", "taken", "silent"]
"""What the engine waits for: to be in place, the window, the next step, samples."""

Wish = Literal["confirm", "repeat", "skip", "stop", "wait"]
"""What an operator may want: a key, or a mover that is still at work (wait)."""


@dataclass(frozen=True, slots=True)
class View:
    """What there is to show now.

    Attributes
    ----------
    phase : what the engine waits for
    hold : the step being carried out
    arrival : where the device is, None while it cannot be told
    stillness : present motion over the limit for rest; below 1 is still
    elapsed : s of device time averaged so far
    sigma : (6,) standard error reached so far, nan before there is one
    reason : why it waits, empty when it does not
    rate_hz : samples a second of device time
    temperature : deg C, nan where unknown
    health : of the link

    """

    phase: Phase
    hold: Hold
    arrival: Arrival | None
    stillness: float
    elapsed: float
    sigma: Array
    reason: str
    rate_hz: float
    temperature: float
    health: Health


class Operator(Protocol):
    """Whoever moves the device: a person at a console, a script, a virtual device."""

    def place(self, hold: Hold) -> None:
        """Ask for a position, or begin to turn there; return at once."""

    def tell(self, text: str) -> None:
        """Show a sentence that must not be missed."""

    def show(self, view: View) -> None:
        """Show the state; called for every block, must not take long."""

    def wish(self) -> Wish | None:
        """What was asked for since the last call; called for every block."""
