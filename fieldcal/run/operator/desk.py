"""Dialogue with the operator, which is recorded in the session."""

from __future__ import annotations

from fieldcal.core.errors import Skipped, Stopped
from fieldcal.planning.steps import Hold
from fieldcal.run.interruptions import RepeatPosition
from fieldcal.run.link_marks import MarkedRecorder
from fieldcal.run.operator.protocol import Operator, Wish
from fieldcal.run.wait_reason import WaitReason, WaitState
from fieldcal.run.waiting import PositionWait


def confirmation_question(waiting: PositionWait) -> WaitReason:
    """Question whether to take a wrong position, asked while the device rests there."""
    return WaitReason(
        WaitState.MISPLACED,
        f"{waiting.problem}; press Enter once more to take it like this, and the result"
        " is NO-GO",
    )


def left_out_error(hold: Hold) -> Skipped:
    """The error that tells a plan that the operator left a position out."""
    return Skipped(f"{hold.position.name} was left out by the operator")


class OperatorDesk:
    """Dialogue of the engine with the operator; messages are marked in the session.

    Parameters
    ----------
    operator : turns the device
    recorder : the session folder being written

    """

    def __init__(self, operator: Operator, recorder: MarkedRecorder) -> None:
        self._operator, self._recorder = operator, recorder

    def tell(self, text: str) -> None:
        """Say a sentence that must not be missed."""
        self._recorder.mark("told", text=text)
        self._operator.tell(text)

    def alarm(self, reason: WaitReason) -> None:
        """Call the operator: something needs to be done."""
        self._recorder.mark("told", text=reason.text)
        self._operator.alarm(reason)

    def ask_back(self, waiting: PositionWait) -> bool:
        """Answer an operator who wants to continue in a wrong position.

        Returns whether they were asked for confirmation; the question is shown as long
        as `confirmation_question` is the reason.
        """
        if waiting.may_insist and waiting.problem:
            self.alarm(confirmation_question(waiting))
            return True
        self.tell(f"not yet: {waiting.problem or waiting.reason.text}")
        return False

    def record_insistence(self, hold: Hold, problem: str) -> None:
        """Record that a position is taken although it is wrong."""
        self._recorder.mark("insisted", position=hold.index, text=problem)

    def stop_if_wanted(self) -> None:
        """End the run if the operator wants to stop; other wishes are ignored.

        Raises
        ------
        Stopped
            If the operator wants to stop.

        """
        if self._operator.wish() == "stop":
            raise Stopped("stopped by the operator")

    def wish(self, hold: Hold) -> Wish | None:
        """Return the operator's wish; one that ends the step is carried out here.

        Raises
        ------
        Stopped, Skipped
            If the run ends, or the position is left out.

        """
        wish = self._operator.wish()
        if wish == "stop":
            raise Stopped("stopped by the operator")
        if wish == "skip":
            self._recorder.mark("skipped", position=hold.index)
            raise left_out_error(hold)
        return wish

    def repeat(self, before: int | None) -> None:
        """Repeat the position taken before; `before` is None if there is none.

        Raises
        ------
        RepeatPosition
            If there is a position to repeat.

        """
        if before is not None:
            self._recorder.mark("repeated", position=before)
            raise RepeatPosition(before)
        self._operator.tell("nothing was taken yet that could be repeated")
