"""The operator's screen: layout of the run's state on a terminal of any size."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from rich.console import Console, Group, RenderableType
from rich.layout import Layout
from rich.measure import Measurement
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from fieldcal.core.positions import Position
from fieldcal.run.operator import widgets
from fieldcal.run.operator.banner import can_draw, draw_large
from fieldcal.run.operator.box import draw_joints
from fieldcal.run.operator.content import RunContent
from fieldcal.run.operator.instruction import TURN
from fieldcal.run.operator.keyboard import HELP, SHORT_HELP
from fieldcal.run.operator.letters import TerminalLetters
from fieldcal.run.operator.protocol import Phase

TALL = 32
"""Fewest lines with room for letters three lines tall."""

SMALL_SCREEN = (76, 22)
"""Columns and lines below which only instruction, reason, time and keys are shown."""

CUT_OFF = " ..."
"""What stands behind the part of a sentence for which there is room."""

COLUMNS_BETWEEN = 3
"""Columns between the list and the picture of the box."""

MIN_LISTED_POSITIONS = 3
"""Fewest positions that are listed, whatever the room."""


class Screen:
    """Layout of the operator's screen.

    Parameters
    ----------
    console : determines width, height and available letters
    content : state of the run that is drawn
    verification : number of the position that is not fitted, None without one
    keys : whether there are keys to press

    """

    def __init__(
        self,
        console: Console,
        content: RunContent,
        verification: int | None,
        keys: Callable[[], bool],
    ) -> None:
        self._console, self._content = console, content
        self._verification, self._keys = verification, keys

    def layout(self) -> RenderableType:
        """The screen, always as high as the terminal, so that it does not jump."""
        columns, rows = SMALL_SCREEN
        if self._console.width < columns or self._console.height < rows:
            return self._with_available_letters(self._small_layout())
        return self._with_available_letters(self._full_layout())

    def _with_available_letters(self, drawn: RenderableType) -> RenderableType:
        """The drawing in letters that the terminal can show."""
        return drawn if self._has_all_letters else TerminalLetters(drawn)

    @property
    def _has_all_letters(self) -> bool:
        return self._console.encoding.lower().startswith("utf")

    @property
    def _phase(self) -> Phase:
        """What is waited for now; the turn as long as nothing is known of it."""
        view, hold = self._content.view, self._content.hold
        return view.phase if view and hold is view.hold else "turning"

    def _full_layout(self) -> RenderableType:
        """The full screen, in a frame."""
        view = self._content.view
        above: list[RenderableType] = [*self._instruction(), Text()]
        if view and self._content.hold is view.hold:
            above.append(widgets.gauges(view))
        above += [*self._sentences(), Text()]
        below: list[RenderableType] = []
        if view:
            below.append(widgets.link_state(view))
        if self._keys():
            below.append(Text(HELP[self._phase]))
        rows = max(
            MIN_LISTED_POSITIONS,
            self._console.height - 2 - self._line_count(*above, *below),
        )
        listing = self._listing(rows)
        drawn = self._drawing(listing, rows) if rows > MIN_LISTED_POSITIONS else []
        beside = Table.grid(padding=(0, COLUMNS_BETWEEN))
        beside.add_row(listing, Text("\n".join(drawn)))
        parts = Layout()
        foot = self._line_count(*below) if below else 0
        parts.split_column(
            Layout(Group(*above, beside), ratio=1),
            Layout(Group(*below), size=max(1, foot), visible=bool(below)),
        )
        title, height = Text(self._content.title), self._console.height
        return Panel(parts, title=title, title_align="left", height=height)

    def _small_layout(self) -> RenderableType:
        """Instruction, reason, seconds and keys, and nothing else."""
        view, hold = self._content.view, self._content.hold
        what = self._content.instruction
        number = f"  {hold.index + 1}" if hold else ""
        if hold and self._content.most is None:
            number += f"/{self._content.count}"
        style = f"bold reverse {what.colour}".strip()
        width = self._console.width
        lines: list[RenderableType] = [
            Text(f" {what.words}{number}".ljust(width), style)
        ]
        name = what.detail.partition(": ")[2] or what.detail  # the number stands above
        if hold and what.words == TURN:
            name = hold.position.name
        lines.append(Text(f" {name}".ljust(width), style))
        if view and hold is view.hold:
            lines += [Text(line) for line in widgets.short_gauges(view)]
        content, count = self._content, self._content.count
        now, out = content.current_index, content.left_out
        taken = Text(widgets.progress(content.taken, now, count, out))
        room = self._console.height - 1 - len(self._console.render_lines(
            Group(*lines, taken)))  # fmt: skip
        lines += [*self._sentences(room), taken]
        parts = Layout()
        parts.split_column(
            Layout(Group(*lines), ratio=1),
            Layout(Text(SHORT_HELP[self._phase]), size=1),
        )
        return parts

    def _sentences(self, room: float = np.inf) -> list[RenderableType]:
        """The last sentences, and the reason for waiting, in a limited height.

        The last one matters most; of those before it as much is shown as has room.
        """
        shown: list[RenderableType] = []
        width = self._console.width
        for text in reversed(self._content.sentences):
            said = Text(f"! {text}", style="bold yellow")
            rows = said.wrap(self._console, width)
            if room < 1:
                break
            if len(rows) > room:
                kept = list(rows)[: int(room)]
                kept[-1].rstrip()
                kept[-1].truncate(width - len(CUT_OFF))
                kept[-1].append(CUT_OFF)
                said = Text("\n").join(kept)
            shown.insert(0, said)
            room -= len(rows)
        return shown

    def _listing(self, rows: int) -> RenderableType:
        """The positions around the present one, with what was reached in each."""
        positions, now = self._content.positions, self._content.current_index
        table = Table.grid(padding=(0, 2))
        first = int(np.clip(now - rows // 2, 0, max(0, len(positions) - rows)))
        for i in range(first, min(len(positions), first + rows)):
            style = "bold" if i == now else ""
            apart = " (verification)" if i == self._verification else ""
            name = positions[i].name + apart
            table.add_row(
                f"{i + 1}", name, self._content.position_state(i), style=style
            )
        return table

    def _drawing(self, listing: RenderableType, rows: int) -> list[str]:
        """Drawing of the wanted position, if letters and room allow it."""
        hold = self._content.hold
        if not self._has_all_letters or hold is None:
            return []
        options = self._console.options
        taken = Measurement.get(self._console, options, listing).maximum
        room = self._console.width - 4 - taken - COLUMNS_BETWEEN
        return draw_joints(hold.position, room, rows)

    def _line_count(self, *parts: RenderableType) -> int:
        """Count the lines that parts of the screen take within its frame."""
        inside = self._console.options.update(width=self._console.width - 4)
        return len(self._console.render_lines(Group(*parts), inside))

    def _instruction(self) -> list[Text]:
        """The one thing to do now, in large letters, and what belongs to it."""
        what, hold = self._content.instruction, self._content.hold
        turn = hold.position if what.words == TURN and hold else None
        style = f"bold reverse {what.colour}".strip()
        width = self._console.width - 4
        if self._console.height >= TALL and self._has_all_letters:
            angles = _angle_lines(turn, width - 4)
            lines = ["", *draw_large(what.words), *angles, "", what.detail, ""]
        else:
            at = f"   {turn.name}" if turn else ""
            lines = [_letterspaced(what.words) + at, what.detail]
        return [Text(f"  {line}".ljust(width), style=style) for line in lines]


def _angle_lines(position: Position | None, width: int) -> list[str]:
    """Where to turn, large if there is room for it."""
    if position is None:
        return []
    alpha, beta, gamma = position.all_degrees or (np.nan, np.nan, 0.0)
    third = f"  γ {gamma:g}°" if gamma else ""
    text = f"α {alpha:g}°  β {beta:g}°{third}"
    drawn = draw_large(text) if can_draw(text) else [position.name]
    fits = max(map(len, drawn)) <= width
    return ["", *(drawn if fits else [position.name])]


def _letterspaced(words: str) -> str:
    """Words with spaces between their letters, which look larger on any terminal."""
    return "   ".join(" ".join(word) for word in words.split())
