"""Operator that also shows the run on the page and takes wishes from there."""

from __future__ import annotations

from fieldcal.planning.steps import Hold
from fieldcal.run.operator.protocol import Operator, OperatorView, Wish
from fieldcal.run.operator.turning import WishesWhileTurning
from fieldcal.run.page.board import Board
from fieldcal.run.page.buttons import Buttons
from fieldcal.run.wait_reason import WaitReason


class PageOperator:
    """Wraps an operator; the page shows the run as well, and its buttons are wishes.

    Parameters
    ----------
    inner : the operator at the console, or the script
    board : content of the page
    buttons : of the page

    """

    def __init__(self, inner: Operator, board: Board, buttons: Buttons) -> None:
        self._inner, self._board, self._buttons = inner, board, buttons
        self._later = WishesWhileTurning()

    def place(self, hold: Hold) -> None:
        """Ask for a position."""
        self._buttons.forget()
        self._later.kept = None
        self._board.position_asked(hold)
        self._inner.place(hold)

    def tell(self, text: str) -> None:
        """Show a sentence that must not be missed."""
        self._board.sentence_told(text)
        self._inner.tell(text)

    def alarm(self, reason: WaitReason, waited: float = 0.0) -> None:
        """Call the operator."""
        self._board.alarm_repeated(waited)
        self._inner.alarm(reason, waited)

    def show(self, view: OperatorView) -> None:
        """Show the state."""
        self._board.view_changed(view)
        self._inner.show(view)

    def wish(self) -> Wish | None:
        """Wish from the page, else from the wrapped operator."""
        inner, pressed = self._inner.wish(), self._buttons.pressed()
        if inner == "stop":
            return inner
        turning = inner == "wait"
        if said := self._later.notice(pressed, turning):
            self.tell(said)
        return self._later.wish(pressed, turning) or inner
