"""The one thing to do now, in words that every display shows alike."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from fieldcal.planning.steps import Hold
from fieldcal.run.operator.protocol import OperatorView
from fieldcal.run.operator.widgets import alert

TURN = "TURN TO"

Colour = Literal["", "cyan", "yellow", "green", "red"]


def position_label(hold: Hold | None, count: int, most: int | None) -> str:
    """Number of the position asked for, of how many; empty where none is.

    `most` is how many there are at most, where they are found on the way.
    """
    many = str(count) if most is None else f"at most {max(most, count)}"
    return f"position {hold.index + 1} of {many}" if hold else ""


@dataclass(frozen=True, slots=True)
class Instruction:
    """What to do.

    Attributes
    ----------
    words : in a few capitals
    detail : what belongs to it
    colour : of both; yellow where something is wrong, red where nothing comes

    """

    words: str
    detail: str
    colour: Colour

    @classmethod
    def of(
        cls, hold: Hold | None, view: OperatorView | None, number: str
    ) -> Instruction:
        """What to do at a step, by the latest view; `number` is that of the position.

        A view of an earlier step says nothing of this one.
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
        return cls("TAKEN", said, "green")
