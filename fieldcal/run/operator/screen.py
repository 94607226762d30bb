"""The operator's screen: how what is known is laid out on a terminal of any size."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from rich.console import Console, Group, RenderableType
from rich.layout import Layout
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from fieldcal.core.positions import Position
from fieldcal.planning.steps import Hold
from fieldcal.run.operator import widgets
from fieldcal.run.operator.banner import drawable, large
from fieldcal.run.operator.box import pictures
from fieldcal.run.operator.instruction import TURN, Instruction, numbered
from fieldcal.run.operator.keyboard import HELP, SHORT_HELP
from fieldcal.run.operator.protocol import OperatorView
from fieldcal.run.operator.widgets import alert

TALL = 32
"""Lines from which there is room for letters three lines tall."""

SMALL = (76, 22)
"""Columns and lines below which only what to do, why, how long and keys are shown."""

FEWEST = 3
"""Positions that are listed however little room there is."""


@dataclass(slots=True)
class ScreenContent:
    """What there is to show.

    Attributes
    ----------
    title : what is being done, and where it is recorded
    positions : all that will be asked for
    verification : number of the position that is not fitted, None without one
    keys : whether there are keys to press
    most : positions that there are at most, None where `positions` has them all
    taken : standard error of each position taken, m/s^2, by number
    said : sentences that must not be missed
    reminder : what stands before the reason for waiting
    view : what the engine is at
    hold : the position asked for

    """

    title: str
    positions: list[Position]
    verification: int | None
    keys: Callable[[], bool]
    most: int | None = None
    taken: dict[int, float] = field(default_factory=dict)
    said: list[str] = field(default_factory=list)
    reminder: str = ""
    view: OperatorView | None = None
    hold: Hold | None = None

    @property
    def number(self) -> str:
        """Number of the position asked for, and how many there are."""
        return numbered(self.hold, len(self.positions), self.most)


class Screen:
    """Lays out what there is to show.

    Parameters
    ----------
    console : whose width, height and letters there are
    shown : what is drawn

    """

    def __init__(self, console: Console, shown: ScreenContent) -> None:
        self._console, self._shown = console, shown

    def drawn(self) -> RenderableType:
        """Draw it; as high as the terminal, so that nothing jumps."""
        columns, rows = SMALL
        if self._console.width < columns or self._console.height < rows:
            return self._small()
        view, now = self._shown.view, self._shown.hold.index if self._shown.hold else -1
        above: list[RenderableType] = [*self._instruction(), Text()]
        if view and self._shown.hold is view.hold:
            above.append(widgets.gauges(view))
        above += [*self._sentences(), Text()]
        below: list[RenderableType] = []
        if view:
            below.append(widgets.link(view))
        if self._shown.keys():
            below.append(Text(HELP))
        rows = max(FEWEST, self._console.height - 2 - self._lines_of(*above, *below))
        listed = widgets.listing(
            self._shown.positions,
            self._shown.taken,
            now,
            rows,
            self._shown.verification,
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
        title, height = Text(self._shown.title), self._console.height
        return Panel(parts, title=title, title_align="left", height=height)

    def _small(self) -> RenderableType:
        """Instruction, reason, seconds and keys, and nothing else."""
        view, hold = self._shown.view, self._shown.hold
        words, detail, colour = self._words()
        number = f"  {hold.index + 1}" if hold else ""
        if hold and self._shown.most is None:
            number += f"/{len(self._shown.positions)}"
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
        lines.append(
            Text(widgets.progress(self._shown.taken, now, len(self._shown.positions)))
        )
        parts = Layout()
        parts.split_column(
            Layout(Group(*lines), ratio=1), Layout(Text(SHORT_HELP), size=1)
        )
        return parts

    def _sentences(self) -> list[RenderableType]:
        """What must not be missed, and why it waits."""
        why = alert(self._shown.view) if self._shown.view else ""
        said = [*self._shown.said, self._shown.reminder + why]
        return [Text(f"! {text}", style="bold yellow") for text in said if text]

    def _drawing(self) -> list[str]:
        """The box as it should stand, where the terminal has the letters."""
        known = self._console.encoding.lower().startswith("utf")
        return pictures(self._shown.hold.position) if known and self._shown.hold else []

    def _lines_of(self, *parts: RenderableType) -> int:
        """Count the lines that parts of the screen take within its frame."""
        inside = self._console.options.update(width=self._console.width - 4)
        return len(self._console.render_lines(Group(*parts), inside))

    def _instruction(self) -> list[Text]:
        """The one thing to do now, in large letters, and what belongs to it."""
        words, detail, colour = self._words()
        turn = self._shown.hold.position if words == TURN and self._shown.hold else None
        style = f"bold reverse {colour}".strip()
        width = self._console.width - 4
        if self._console.height >= TALL:
            lines = ["", *large(words), *_angles(turn, width - 4), "", detail, ""]
        else:
            lines = [_spaced(words) + (f"   {turn.name}" if turn else ""), detail]
        return [Text(f"  {line}".ljust(width), style=style) for line in lines]

    def _words(self) -> tuple[str, str, str]:
        """What is said large, what small, and its colour."""
        shown = self._shown
        now = Instruction.of(shown.hold, shown.view, shown.number)
        return now.words, now.detail, now.colour


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
