"""The operator's terminal: what to do in large plain words, and what it waits for.

Nothing here blocks: the engine calls `show` for every block, and the screen is drawn at
most `FRAMES` times a second from the latest view. It goes on by itself; keys only
confirm, repeat, skip or stop.
"""

from __future__ import annotations

from collections.abc import Sequence
from time import monotonic

import numpy as np
from rich.console import Console, Group, RenderableType
from rich.layout import Layout
from rich.live import Live
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from fieldcal.core.positions import Position
from fieldcal.planning.steps import Hold
from fieldcal.run.movers import Mover
from fieldcal.run.operator import widgets
from fieldcal.run.operator.banner import drawable, large
from fieldcal.run.operator.box import pictures
from fieldcal.run.operator.keyboard import HELP, SHORT_HELP, Keyboard
from fieldcal.run.operator.protocol import OperatorView, Wish
from fieldcal.run.operator.widgets import alert
from fieldcal.run.wait_reason import WaitReason, reminder

FRAMES = 8.0
"""Drawings a second."""

TALL = 32
"""Lines from which there is room for letters three lines tall."""

SMALL = (76, 22)
"""Columns and lines below which only what to do, why, how long and keys are shown."""

TURN = "TURN TO"

FEWEST = 3
"""Positions that are listed however little room there is."""

ASKED_AGAIN = 5.0
"""How long a second press of a key that gives something up is waited for, s."""


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
    ) -> None:
        self._title = title
        self._positions = tuple(positions)
        self._mover = mover
        self._console = console
        self._keyboard = keyboard
        self._verification = verification
        self._taken: dict[int, float] = {}
        self._said: list[str] = []
        self._said_before: list[str] = []
        self._reminder = ""
        self._view: OperatorView | None = None
        self._skips = -ASKED_AGAIN
        self._hold: Hold | None = None
        self._drawn = 0.0
        self._lines: set[str] = set()
        self._live: Live | None = None
        screen = self._console.is_terminal and not self._console.is_dumb_terminal
        if screen and not plain:
            # a screen of its own: what is resized leaves nothing of the last one behind
            self._live = Live(console=self._console, auto_refresh=False, screen=True)

    def __enter__(self) -> ConsoleOperator:
        if self._keyboard:
            self._keyboard.__enter__()
        if self._live:
            self._live.start()
            self._draw()
        return self

    def __exit__(self, *exc: object) -> None:
        if self._live:
            self._draw()
            self._live.stop()
        if self._keyboard:
            self._keyboard.__exit__()

    def place(self, hold: Hold) -> None:
        """Ask for a position."""
        self._hold = hold
        self._said = self._said_before = self._said[-1:]
        self._lines.clear()
        self._taken.pop(hold.index, None)
        self._bell()
        if self._keyboard:
            self._keyboard.forget()
        self._log(
            f"position {hold.index + 1}: turn to {hold.position.name}, hold still"
        )
        self._mover.turn(hold.position, hold.index)
        self._draw()

    def tell(self, text: str) -> None:
        """Keep a sentence on the screen."""
        self._said = [*(t for t in self._said[-1:] if t != text), text]
        self._ring(text)

    def alarm(self, reason: WaitReason, waited: float = 0.0) -> None:
        """Ring for the reason that stands on the screen."""
        self._reminder = reminder(waited)
        self._ring(self._reminder + reason.text)

    def _ring(self, text: str) -> None:
        self._bell()
        self._log(f"! {text}")
        self._draw()

    def wish(self) -> Wish | None:
        """The key that was pressed, or the wish to wait for the mover."""
        pressed = self._keyboard.pressed() if self._keyboard else None
        if pressed == "skip" and monotonic() - self._skips >= ASKED_AGAIN:
            self._skips, pressed = monotonic(), None
            name = self._hold.position.name if self._hold else "this position"
            self.tell(f"press s once more to leave {name} out of the result")
        return pressed or ("wait" if self._mover.busy() else None)

    def show(self, view: OperatorView) -> None:
        """Draw the view, unless the last drawing is too recent."""
        begins = view.phase == "averaging" and self._phase != "averaging"
        self._view = view
        self._reminder = self._reminder if alert(view) else ""
        if begins:
            self._said = self._said_before  # what was said of the turn is done
        if view.phase == "taken":
            known = view.sigma[:3][np.isfinite(view.sigma[:3])]
            self._taken[view.hold.index] = float(known.max()) if len(known) else np.nan
            self._said = []
            self._bell()
        if self._live is None:
            self._log_view(view)
        elif monotonic() - self._drawn >= 1 / FRAMES or view.phase == "taken":
            self._draw()

    def _bell(self) -> None:
        if self._live:
            self._console.bell()

    @property
    def _phase(self) -> str:
        return self._view.phase if self._view else ""

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
        """What is shown now; as high as the terminal, so that nothing jumps."""
        columns, rows = SMALL
        if self._console.width < columns or self._console.height < rows:
            return self._small()
        view, now = self._view, self._hold.index if self._hold else -1
        above: list[RenderableType] = [*self._instruction(), Text()]
        if view and self._hold is view.hold:
            above.append(widgets.gauges(view))
        above += [*self._sentences(), Text()]
        below: list[RenderableType] = []
        if view:
            below.append(widgets.link(view))
        if self._keyboard and self._keyboard.there:
            below.append(Text(HELP))
        rows = max(FEWEST, self._console.height - 2 - self._lines_of(*above, *below))
        listed = widgets.listing(
            self._positions, self._taken, now, rows, self._verification
        )
        drawn = self._drawing() if rows > FEWEST else []
        beside = Table.grid(padding=(0, 3))
        beside.add_row(listed, Text("\n".join(drawn[:rows])))
        parts = Layout()
        foot = self._lines_of(*below) if below else 0
        parts.split_column(
            Layout(Group(*above, beside), ratio=1),
            Layout(Group(*below), size=max(1, foot), visible=bool(below)),
        )
        title, height = Text(self._title), self._console.height
        return Panel(parts, title=title, title_align="left", height=height)

    def _small(self) -> RenderableType:
        """Instruction, reason, seconds and keys, and nothing else."""
        view, hold = self._view, self._hold
        words, detail, colour = self._words()
        number = f"  {hold.index + 1}/{len(self._positions)}" if hold else ""
        style = f"bold reverse {colour}".strip()
        width = self._console.width
        lines: list[RenderableType] = [Text(f" {words}{number}".ljust(width), style)]
        what = detail.partition(": ")[2] or detail  # the number stands above
        name = hold.position.name if hold and words == TURN else what
        lines.append(Text(f" {name}".ljust(width), style))
        if view and hold is view.hold:
            lines += [Text(line) for line in widgets.short(view)]
        lines += self._sentences()
        now = hold.index if hold else -1
        lines.append(Text(widgets.progress(self._taken, now, len(self._positions))))
        parts = Layout()
        parts.split_column(
            Layout(Group(*lines), ratio=1), Layout(Text(SHORT_HELP), size=1)
        )
        return parts

    def _sentences(self) -> list[RenderableType]:
        """What must not be missed, and why it waits."""
        why = alert(self._view) if self._view else ""
        said = [*self._said, self._reminder + why]
        return [Text(f"! {text}", style="bold yellow") for text in said if text]

    def _drawing(self) -> list[str]:
        """The box as it should stand, where the terminal has the letters."""
        known = self._console.encoding.lower().startswith("utf")
        return pictures(self._hold.position) if known and self._hold else []

    def _lines_of(self, *parts: RenderableType) -> int:
        """Count the lines that parts of the screen take within its frame."""
        inside = self._console.options.update(width=self._console.width - 4)
        return len(self._console.render_lines(Group(*parts), inside))

    def _instruction(self) -> list[Text]:
        """The one thing to do now, in large letters, and what belongs to it."""
        words, detail, colour = self._words()
        turn = self._hold.position if words == TURN and self._hold else None
        style = f"bold reverse {colour}".strip()
        width = self._console.width - 4
        if self._console.height >= TALL:
            lines = ["", *large(words), *_angles(turn, width - 4), "", detail, ""]
        else:
            lines = [_spaced(words) + (f"   {turn.name}" if turn else ""), detail]
        return [Text(f"  {line}".ljust(width), style=style) for line in lines]

    def _words(self) -> tuple[str, str, str]:
        """What is said large, what small, and its colour."""
        hold = self._hold
        view = self._view if self._view and self._view.hold is hold else None
        if hold is None:
            return "WAIT", "for the device", ""
        number = f"position {hold.index + 1} of {len(self._positions)}"
        if view is None or view.phase == "turning":
            if view is None or view.arrival is None or not view.arrival.ok:
                wrong = view is not None and alert(view)
                return TURN, f"{number}, then let go", "yellow" if wrong else "cyan"
            if alert(view):
                return "WAIT", f"{number}: it is in place, hands off", "yellow"
            return "HANDS OFF", f"{number}: it is in place", "cyan"
        if view.phase == "silent":
            return "NO SAMPLES", f"{number}: nothing is lost of what was taken", "red"
        if view.phase == "averaging":
            return "HOLD STILL", f"{number}: do not touch the device", "green"
        return "TAKEN", number, "green"


def _angles(position: Position | None, width: int) -> list[str]:
    """Where to turn, large if there is room for it."""
    if position is None:
        return []
    alpha, beta = position.degrees or (np.nan, np.nan)
    text = f"α {alpha:g}°  β {beta:g}°"
    drawn = large(text) if drawable(text) else [position.name]
    fits = max(map(len, drawn)) <= width
    return ["", *(drawn if fits else [position.name])]


def _spaced(words: str) -> str:
    """Letters set apart: larger than their neighbours on any terminal."""
    return "   ".join(" ".join(word) for word in words.split())
