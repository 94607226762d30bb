"""A table as a list of its rows, for a terminal in which its cells would be cut off.

A number without its last digits is another number. So where a table does not fit, each
row has a line of its own with its first cell, and below it the others behind the names
of their columns. An uncertainty and a unit stand behind the value that they belong to.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.segment import Segment
from rich.table import Table
from rich.text import Text

NO_TEXT = re.compile(r"[\s…\u2500-\u257f]")
"""What is no text of a cell: space, a mark of what was cut off, lines of the table."""

UNCERTAINTY, UNIT, NO_UNIT = "±", "unit", "1"
"""Beginning of the name of a column of uncertainties; name of that of the units, and
what stands there for a number without a unit."""


def cuts_cells(table: Table, drawn: Iterable[Segment], width: int) -> bool:
    """Whether a table with named columns lost a part of its text when it was drawn.

    Parameters
    ----------
    table : that was drawn
    drawn : what came of it
    width : of the terminal, characters

    """
    if not table.show_header:
        return False
    cells = [str(cell) for column in table.columns for cell in column.cells]
    cells += [str(column.header) for column in table.columns]
    lines = Segment.split_and_crop_lines(drawn, width)
    seen = "".join(segment.text for line in lines for segment in line)
    title = len(NO_TEXT.sub("", str(table.title or "")))
    return len(NO_TEXT.sub("", seen)) < title + len(NO_TEXT.sub("", "".join(cells)))


def as_row_lists(table: Table) -> Group:
    """The rows of a table one below the other."""
    names = [str(column.header) for column in table.columns]
    lines: list[RenderableType] = []
    if table.title:
        lines.append(Text(str(table.title), style="italic"))
    for cells in zip(*(column.cells for column in table.columns), strict=True):
        lines += _row_lines(names, [str(cell) for cell in cells])
    return Group(*lines)


def _row_lines(names: Sequence[str], cells: Sequence[str]) -> list[RenderableType]:
    """Lines of a row: its first cell, and the others with their names."""
    first, others = cells[0], list[str]()
    for name, cell in zip(names[1:], cells[1:], strict=True):
        if not cell.strip():
            continue
        before = names[names.index(name) - 1]
        if name.startswith(UNCERTAINTY) and others:
            others[-1] += f" {UNCERTAINTY} {cell}"
        elif name == UNIT and cell == NO_UNIT:
            continue
        elif name == UNIT and before.startswith(UNCERTAINTY) and others:
            others[-1] += f" {cell}"
        elif name == UNIT:
            first = f"{first} ({cell})"
        else:
            others.append(f"{name}: {cell}" if name else cell)
    return [
        Text(first, style="bold"),
        *(Padding(Text(t), (0, 0, 0, 2)) for t in others),
    ]
