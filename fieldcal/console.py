"""The operator's terminal: what to do in large plain words, and what it waits for.

Nothing here blocks: the engine calls `show` for every block, and the screen is drawn at
most `FRAMES` times a second from the latest view.
"""

from __future__ import annotations

from collections.abc import Sequence
from time import monotonic

import numpy as np
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.panel import Panel
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from fieldcal.movers import Mover
from fieldcal.plan import Hold
from fieldcal.positions import Position
from fieldcal.view import View

FRAMES = 8.0
"""Drawings a second."""

METER = 20
"""Width of a meter, characters."""


class ConsoleOperator:
    """Shows a person what to do; a context manager that owns the screen.

    Parameters
    ----------
    title : what is being done, and where it is recorded
    positions : all that will be asked for
    mover : who turns the device
    console : where to draw; plain lines are written if it is no terminal
    plain : write lines although it is one

    """

    def __init__(
        self,
        title: str,
        positions: Sequence[Position],
        mover: Mover,
        console: Console | None = None,
        plain: bool = False,
    ) -> None:
        self._title = title
        self._positions = tuple(positions)
        self._mover = mover
        self._console = console or Console()
        self._taken: dict[int, float] = {}
        self._said: list[str] = []
        self._view: View | None = None
        self._hold: Hold | None = None
        self._drawn = 0.0
        self._line = ""
        self._live: Live | None = None
        if not plain and self._console.is_terminal:
            self._live = Live(console=self._console, auto_refresh=False)

    def __enter__(self) -> ConsoleOperator:
        if self._live:
            self._live.start()
        return self

    def __exit__(self, *exc: object) -> None:
        if self._live:
            self._draw()
            self._live.stop()

    def place(self, hold: Hold) -> None:
        """Ask for a position."""
        self._hold = hold
        self._console.bell() if self._live else None
        self._log(
            f"position {hold.index + 1}: turn to {hold.position.name}, hold still"
        )
        self._mover.turn(hold.position)

    def tell(self, text: str) -> None:
        """Keep a sentence on the screen."""
        self._said = [*self._said[-1:], text]
        self._console.bell() if self._live else None
        self._log(f"! {text}")

    def show(self, view: View) -> None:
        """Draw the view, unless the last drawing is too recent."""
        self._view = view
        if view.phase == "taken":
            self._taken[view.hold.index] = float(np.nanmax(view.sigma[:3]))
            self._said = []
        if self._live is None:
            self._log_view(view)
        elif monotonic() - self._drawn >= 1 / FRAMES or view.phase == "taken":
            self._drawn = monotonic()
            self._draw()

    def _log(self, text: str) -> None:
        if self._live is None and text != self._line:
            self._line = text
            self._console.print(text, markup=False, highlight=False, soft_wrap=True)

    def _log_view(self, view: View) -> None:
        where = f"position {view.hold.index + 1}"
        if view.phase == "turning":
            self._log(f"{where}: {view.reason.partition(':')[0]}")
        elif view.phase == "averaging":
            step = 10 * int(view.elapsed // 10)
            self._log(f"{where}: averaging, {step} of {view.hold.seconds:g} s")
        else:
            self._log(f"{where}: taken, ± {_sigma(view)}")

    def _draw(self) -> None:
        if self._live:
            self._live.update(self.screen(), refresh=True)

    def screen(self) -> RenderableType:
        """What is shown now."""
        parts: list[RenderableType] = [self._instruction(), Text()]
        if self._view:
            parts += [*self._gauges(self._view), Text()]
        parts.append(self._list())
        parts += [Text(f"! {text}", style="bold yellow") for text in self._said]
        if self._view:
            parts.append(_link(self._view))
        return Panel(Group(*parts), title=self._title, title_align="left")

    def _instruction(self) -> Text:
        view, hold = self._view, self._hold
        if hold is None:
            return Text("Waiting for the device", style="bold")
        if view is None or view.hold is not hold or view.phase == "turning":
            return Text(f"TURN to {hold.position.name}, then let go", style="bold cyan")
        if view.phase == "averaging":
            return Text("HOLD STILL: do not touch the device", style="bold green")
        return Text("TAKEN", style="bold green")

    def _gauges(self, view: View) -> list[RenderableType]:
        grid = Table.grid(padding=(0, 2))
        grid.add_column(width=10)
        grid.add_column()
        if view.phase == "turning":
            for name, seen, wanted in _angles(view):
                grid.add_row(name, _inclinometer(seen, wanted))
            told = view.reason and view.reason in self._said
            grid.add_row("waits for", "the turn: see below" if told else view.reason)
        else:
            left = max(0.0, view.hold.seconds - view.elapsed)
            bar = ProgressBar(
                view.hold.seconds, min(view.elapsed, view.hold.seconds), 30
            )
            grid.add_row("averaging", bar)
            grid.add_row("time left", f"{left:.0f} s")
            grid.add_row("reached", f"± {_sigma(view)}")
        grid.add_row("stillness", _stillness(view.stillness))
        return [grid]

    def _list(self) -> Table:
        table = Table.grid(padding=(0, 2))
        now = self._hold.index if self._hold else -1
        for i, position in enumerate(self._positions):
            if i in self._taken:
                state = f"taken   ± {1e3 * self._taken[i]:.2f} mm/s²"
            else:
                state = "now" if i == now else ""
            style = "bold" if i == now else "dim" if i not in self._taken else ""
            table.add_row(f"{i + 1}", position.name, state, style=style)
        return table


def _angles(view: View) -> list[tuple[str, float, float]]:
    wanted = view.hold.position.degrees
    if view.arrival is None or wanted is None:
        return []
    seen = (view.arrival.alpha_deg, view.arrival.beta_deg)
    return list(zip("αβ", seen, wanted, strict=True))


def _inclinometer(seen: float, wanted: float) -> Text:
    """Where it is, where it should be, and which way to turn."""
    off = wanted - seen
    arrow = "in place" if abs(off) < 1 else f"turn {off:+.1f}°"
    return Text(f"{seen:+7.1f}°   wanted {wanted:+.1f}°   {arrow}")


def _stillness(level: float) -> Text:
    if not np.isfinite(level):
        return Text("listening to the device's noise")
    filled = int(np.clip(round(level * METER / 2), 0, METER))
    word = "still" if level < 1 else "MOVING"
    return Text(
        f"[{'#' * filled:<{METER}}] {word}", style="" if level < 1 else "yellow"
    )


def _sigma(view: View) -> str:
    acc, gyr = view.sigma[:3], view.sigma[3:]
    parts = []
    if np.isfinite(acc).any():
        parts.append(f"{1e3 * np.nanmax(acc):.2f} mm/s²")
    if np.isfinite(gyr).any():
        parts.append(f"{1e3 * np.nanmax(gyr):.3f} mrad/s")
    return ", ".join(parts) or "not known yet"


def _link(view: View) -> Text:
    health = view.health
    parts = [f"{view.rate_hz:.0f} Hz", f"{health.samples} samples"]
    parts.append(f"{health.gaps} gaps, {health.bad} bad frames")
    if np.isfinite(view.temperature):
        parts.append(f"{view.temperature:.1f} °C")
    if health.restarts:
        parts.append(f"restarts: {health.restarts}")
    if health.clock and health.clock.real_time:
        clock = health.clock
        parts.append(f"clock {clock.fast_ppm:+.0f} ± {clock.sigma_ppm:.1g} ppm")
    return Text("link: " + " · ".join(parts), style="dim")
