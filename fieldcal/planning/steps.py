"""Plans: generators that yield the steps of a procedure and do no I/O.

A plan never touches a device, a clock or a screen. It yields steps; the engine carries
each one out and sends the result back, or throws the error that a step ended in. So a
console, a script, a simulator and a test drive the same plan, and a plan can be listed
without hardware. A plan does not yield while it is being closed.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import Any, TypeVar

from fieldcal.core.positions import Position
from fieldcal.windows import Average

R = TypeVar("R")


@dataclass(frozen=True, slots=True)
class Hold:
    """Have the device put in a position and average it.

    Attributes
    ----------
    index : the number of the position in the session
    position : the position
    seconds : window length, s of device time
    sigma : stop earlier once each accelerometer mean is this well known, m/s^2
    further : positions that are asked for behind it, of those not known from the start

    """

    index: int
    position: Position
    seconds: float
    sigma: float | None = None
    further: int = 0


@dataclass(frozen=True, slots=True)
class Note:
    """Tell the operator something."""

    text: str


@dataclass(frozen=True, slots=True)
class Add:
    """Take one more position into the session; the reply is its number.

    Attributes
    ----------
    position : the position
    seconds : length of its window, s; None for that of the others

    """

    position: Position
    seconds: float | None = None


@dataclass(frozen=True, slots=True)
class Repeat:
    """Discard the window of a position, and start the plan again.

    Attributes
    ----------
    index : the number of the position in the session

    """

    index: int


@dataclass(frozen=True, slots=True)
class Judge:
    """Judge the windows recorded so far; the reply is an interim result.

    Attributes
    ----------
    quick : whether the search may start from the previous explanation

    """

    quick: bool = False


Step = Hold | Note | Add | Repeat | Judge
Plan = Generator[Step, Any, R]


def hold(
    index: int,
    position: Position,
    seconds: float,
    sigma: float | None = None,
    further: int = 0,
) -> Plan[Average]:
    """Yield a `Hold`; the reply is its average."""
    reply: Average = yield Hold(index, position, seconds, sigma, further)
    return reply


def add(position: Position, seconds: float | None = None) -> Plan[int]:
    """Yield an `Add`; the reply is the number that the position has."""
    reply: int = yield Add(position, seconds)
    return reply


def note(text: str) -> Plan[None]:
    """Yield a `Note`."""
    yield Note(text)
