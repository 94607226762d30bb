"""The present instruction to the operator, in the same words on every display."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from fieldcal.planning.steps import Hold
from fieldcal.run.operator.protocol import OperatorView
from fieldcal.run.operator.widgets import alert

TURN = "TURN TO"

SHOWN_AFTER_S = 2.0
"""Time after which it is said for how long something is being worked out, s."""

Colour = Literal["", "cyan", "yellow", "green", "red"]


def position_label(hold: Hold | None, count: int, most: int | None) -> str:
    """Number of the requested position and of all positions; empty without one.

    `most` is the largest number of positions if they are chosen during the run.
    """
    many = str(count) if most is None else f"at most {max(most, count)}"
    return f"position {hold.index + 1} of {many}" if hold else ""


@dataclass(frozen=True, slots=True)
class Instruction:
    """Instruction to the operator.

    Attributes
    ----------
    words : a few words in capitals
    detail : further words
    colour : of both; yellow if something is wrong, red if no samples arrive

    """

    words: str
    detail: str
    colour: Colour

    @classmethod
    def of(
        cls, hold: Hold | None, view: OperatorView | None, number: str, worked: float
    ) -> Instruction:
        """Instruction at a step by the latest view.

        Parameters
        ----------
        hold : the step
        view : the latest view; one of an earlier step is ignored
        number : label of the position
        worked : for how long the next step is being worked out, s

        """
        if hold is None:
            return cls("WAIT", "for the device", "")
        if view is None or view.hold is not hold:
            return cls(TURN, f"{number}, then let go", "cyan")
        if view.phase == "turning":
            if view.arrival is None or not view.arrival.ok:
                colour: Colour = "yellow" if alert(view) else "cyan"
                return cls(TURN, f"{number}, then let go", colour)
            if alert(view):
                return cls("WAIT", f"{number}: it is in place, hands off", "yellow")
            return cls("HANDS OFF", f"{number}: it is in place", "cyan")
        if view.phase == "silent":
            said = f"{number}: nothing is lost of what was taken"
            return cls("NO SAMPLES", said, "red")
        if view.phase == "averaging":
            return cls("HOLD STILL", f"{number}: do not touch the device", "green")
        said = f"{number}: what comes next is being worked out"
        since = f", {worked:.0f} s" if worked >= SHOWN_AFTER_S else ""
        return cls("TAKEN", f"{said}{since}", "green")
