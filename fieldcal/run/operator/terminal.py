"""The operator's terminal: what to do in large plain words, and what it waits for.

Nothing here blocks: the engine calls `show` for every block, and the screen is drawn at
most `FRAMES_PER_S` times a second from the latest view. It goes on by itself; keys only
confirm, repeat, skip or stop. While the run works out what comes next, the engine calls
nothing, and the screen says for how long.
"""

from __future__ import annotations

from collections.abc import Sequence
from time import monotonic

from rich.console import Console, RenderableType
from rich.live import Live

from fieldcal.core.positions import Position
from fieldcal.planning.steps import Hold
from fieldcal.run.movers import Mover
from fieldcal.run.operator import widgets
from fieldcal.run.operator.content import RunContent
from fieldcal.run.operator.keyboard import LEAVE_PASTES, MARK_PASTES, Keyboard
from fieldcal.run.operator.protocol import OperatorView, Wish
from fieldcal.run.operator.redrawing import Redrawing
from fieldcal.run.operator.screen import Screen
from fieldcal.run.operator.turning import WishesWhileTurning
from fieldcal.run.operator.widgets import alert
from fieldcal.run.wait_reason import WaitReason, reminder

FRAMES_PER_S = 8.0
"""Drawings a second."""

CONFIRM_WITHIN_S = 5.0
"""Time within which a key that discards something must be pressed again, s."""


class ConsoleOperator:
    """Shows a person what to do; a context manager that owns the screen.

    Parameters
    ----------
    title : what is being done, and where it is recorded
    positions : all that will be asked for
    mover : who turns the device
    console : where to draw; plain lines are written if it is no terminal
    plain : write lines although it is one
    keyboard : where keys come from; none are read unless given
    verification : number of the position that is not fitted, if there is one
    most : positions that there are at most, where they are found on the way

    """

    def __init__(
        self,
        title: str,
        positions: Sequence[Position],
        mover: Mover,
        console: Console,
        plain: bool = False,
        keyboard: Keyboard | None = None,
        verification: int | None = None,
        most: int | None = None,
    ) -> None:
        self._mover = mover
        self._console = console
        self._keyboard = keyboard
        self._shown = RunContent(title, positions, most)
        self._screen = Screen(console, self._shown, verification, self._has_keys)
        self._skips, self._asked = -CONFIRM_WITHIN_S, ""
        self._later = WishesWhileTurning()
        self._drawn = 0.0
        self._lines: set[str] = set()
        self._live: Live | None = None
        self._redrawing, self._taken_at = Redrawing(self._draw_work), 0.0
        screen = self._console.is_terminal and not self._console.is_dumb_terminal
        if screen and not plain:
            # a screen of its own: what is resized leaves nothing of the last one behind
            self._live = Live(console=self._console, auto_refresh=False, screen=True)

    def __enter__(self) -> ConsoleOperator:
        if self._keyboard:
            self._keyboard.__enter__()
        if self._live:
            self._live.start()
            self._order(MARK_PASTES)
            self._draw()
        return self

    def __exit__(self, *exc: object) -> None:
        self._redrawing.stop()
        if self._live:
            self._draw()
            self._order(LEAVE_PASTES)
            self._live.stop()
        if self._keyboard:
            self._keyboard.__exit__()

    def _order(self, sequence: str) -> None:
        """Give the terminal an order, unless it would show that as letters."""
        if self._has_keys() and not self._console.legacy_windows:
            self._console.file.write(sequence)

    def place(self, hold: Hold) -> None:
        """Ask for a position."""
        self._redrawing.stop()
        before = self._shown.hold
        if before is None or before.index != hold.index:
            self._skips = -CONFIRM_WITHIN_S  # it was asked about the one before
        self._shown.position_asked(hold)
        self._lines.clear()
        self._bell()
        self._later.kept = None  # like keys, meant for an earlier step
        if self._keyboard:
            self._keyboard.forget()
        self._log(
            f"position {hold.index + 1}: turn to {hold.position.name}, hold still"
        )
        self._mover.turn(hold.position, hold.index)
        self._draw()

    def tell(self, text: str) -> None:
        """Keep a sentence on the screen."""
        self._redrawing.stop()
        self._shown.sentence_told(text)
        self._ring(text)
        self._redraw_while_working()

    def alarm(self, reason: WaitReason, waited: float = 0.0) -> None:
        """Ring for the reason shown on the screen."""
        self._redrawing.stop()
        self._shown.alarm_repeated(waited)
        self._ring(reminder(waited) + reason.text)

    def _ring(self, text: str) -> None:
        self._bell()
        self._log(f"! {text}")
        self._draw()

    def wish(self) -> Wish | None:
        """The key that was pressed, or the wish to wait for the mover."""
        pressed = self._keyboard.pressed() if self._keyboard else None
        asked = monotonic() - self._skips < CONFIRM_WITHIN_S
        if pressed == "skip" or not asked:
            self._shown.sentence_withdrawn(
                self._asked
            )  # answered, or s would only ask again
        if pressed == "skip" and not asked:
            self._skips, pressed = monotonic(), None
            self._ask_back()
        elif pressed == "skip":
            self._skips = -CONFIRM_WITHIN_S
        if pressed == "stop":
            return pressed
        turning = self._mover.busy()
        if said := self._later.notice(pressed, turning):
            self.tell(said)
        return self._later.wish(pressed, turning)

    def _ask_back(self) -> None:
        """Ask whether the position is to be left out."""
        hold = self._shown.hold
        name = hold.position.name if hold else "this position"
        self._asked = f"press s once more to leave {name} out of the result"
        self.tell(self._asked)

    def show(self, view: OperatorView) -> None:
        """Draw the view, unless the last drawing is too recent."""
        self._redrawing.stop()
        self._shown.view_changed(view)
        if view.phase == "taken":
            self._bell()
        if self._live is None:
            self._log_view(view)
        elif monotonic() - self._drawn >= 1 / FRAMES_PER_S or view.phase == "taken":
            self._draw()
        self._taken_at = monotonic()
        self._redraw_while_working()

    def _redraw_while_working(self) -> None:
        """Go on drawing while the run works out what comes next."""
        if self._live and self._live.is_started and self._shown.is_worked_out:
            self._redrawing.start()

    def _draw_work(self) -> None:
        """Draw for how long the run is at it."""
        self._shown.worked = monotonic() - self._taken_at
        self._draw()

    def _bell(self) -> None:
        if self._live:
            self._console.bell()

    def _log_state(self, text: str) -> None:
        """Log a state once for each time that a position is asked for."""
        if text not in self._lines:
            self._lines.add(text)
            self._log(text)

    def _log(self, text: str) -> None:
        if self._live is None:
            self._console.print(text, markup=False, highlight=False, soft_wrap=True)

    def _log_view(self, view: OperatorView) -> None:
        where = f"position {view.hold.index + 1}"
        if view.phase == "averaging":
            step = 10 * int(view.elapsed // 10)
            self._log_state(f"{where}: averaging, {step} of {view.hold.seconds:g} s")
        elif view.phase == "taken":
            self._log(f"{where}: taken, ± {widgets.sigma(view) or 'not known'}")
        elif not alert(view):
            self._log_state(f"{where}: {view.reason.text}")

    def _draw(self) -> None:
        if self._live:
            self._drawn = monotonic()
            self._live.update(self.screen(), refresh=True)

    def screen(self) -> RenderableType:
        """The present drawing."""
        return self._screen.layout()

    def _has_keys(self) -> bool:
        return self._keyboard is not None and self._keyboard.has_keys
