"""Why a run waits: a state, and what an operator reads of it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto


class WaitState(Enum):
    """State of a run that waits."""

    NOTHING = auto()
    LISTENING = auto()
    MOVING = auto()
    SETTLING = auto()
    TURNING = auto()
    MISPLACED = auto()
    WARMING_UP = auto()
    NO_SAMPLES = auto()
    WRONG_UNIT = auto()
    TAKEN_BEFORE = auto()


TEXTS = {
    WaitState.NOTHING: "",
    WaitState.LISTENING: "listening to the noise",
    WaitState.MOVING: "moving: waiting for it to rest",
    WaitState.SETTLING: "settling",
    WaitState.TURNING: "waiting for the turn",
    WaitState.TAKEN_BEFORE: "taken before",
}
"""Texts of the states that need no explanation."""

FOR_OPERATOR = {
    WaitState.MISPLACED,
    WaitState.WARMING_UP,
    WaitState.NO_SAMPLES,
    WaitState.WRONG_UNIT,
}
"""States in which the operator has to do something."""


@dataclass(frozen=True, slots=True)
class WaitReason:
    """A state with its explanation.

    Attributes
    ----------
    state : what the run waits for
    detail : one sentence about a state that needs the operator; empty otherwise

    """

    state: WaitState = WaitState.NOTHING
    detail: str = ""

    @property
    def needs_operator(self) -> bool:
        """Whether the operator has to do something."""
        return self.state in FOR_OPERATOR

    @property
    def text(self) -> str:
        """Text for the operator; empty if the run does not wait."""
        if self.state is WaitState.WARMING_UP:
            return f"{self.detail}; Enter goes on"
        return self.detail or TEXTS[self.state]


def reminder(waited: float) -> str:
    """Prefix of a reason that has been shown for `waited` s already."""
    return f"still waiting, {waited:.0f} s: " if waited else ""
