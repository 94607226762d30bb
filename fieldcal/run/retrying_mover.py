"""A mover that is retried for some time after its connection is lost."""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic

from fieldcal.core.errors import MoverGone
from fieldcal.core.positions import Position
from fieldcal.run.movers import Mover

RETRY_S = 2.0
"""Time between two attempts, s."""


class RetryingMover:
    """Wraps a mover; a turn is repeated while its connection is lost.

    Parameters
    ----------
    mover : to be wrapped
    patience : how long to try, s

    Attributes
    ----------
    tell : called with a sentence when the connection is lost

    """

    def __init__(self, mover: Mover, patience: float) -> None:
        self._mover, self._patience = mover, patience
        self.tell: Callable[[str], None] = lambda text: None
        self._order = (Position.deg(0.0, 0.0), 0)
        self._first: MoverGone | None = None
        self._down = False
        self._until = self._next = 0.0

    def turn(self, position: Position, number: int = 0) -> None:
        """Begin to turn; `busy` tries again what fails."""
        self._order, self._first = (position, number), None
        self._try(self._turn)

    def busy(self) -> bool:
        """Whether it is turning, or its connection is lost.

        Raises
        ------
        MoverFailed
            If the connection has not come back in time.

        """
        if not self._down:
            at_work = self._try(self._mover.busy)
            if not (self._down or at_work):
                self._first = None
            return self._down or at_work
        if self._first is not None and monotonic() >= self._until:
            raise self._first
        if monotonic() >= self._next:
            self._try(self._turn)
        return True

    def _turn(self) -> bool:
        self._mover.turn(*self._order)
        return True

    def _try(self, what: Callable[[], bool]) -> bool:
        """Try an action of the mover; a failure marks it as lost from the first one."""
        try:
            done = what()
        except MoverGone as gone:
            self._down, self._next = True, monotonic() + RETRY_S
            if self._first is None:
                self._first, self._until = gone, monotonic() + self._patience
                self.tell(f"{gone}; tried again for {self._patience:g} s")
            return False
        self._down = False
        return done
