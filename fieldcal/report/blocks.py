"""Blocks of a page: sections of texts, tables, charts and matrices.

Sections are built by pure functions and know nothing of HTML; the template turns them
into it and escapes every text.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal

from fieldcal.report.charts import Chart, RecordingChart

Tone = Literal["", "good", "warn", "bad"]


@dataclass(frozen=True, slots=True)
class Cell:
    """A cell of a table; `bar` from 0 to 1 draws a bar behind the text."""

    text: str
    tone: Tone = ""
    bar: float | None = None


@dataclass(frozen=True, slots=True)
class Paragraph:
    """A paragraph."""

    kind: ClassVar[str] = "text"
    text: str


@dataclass(frozen=True, slots=True)
class WarningBox:
    """A warning or a note in a box."""

    kind: ClassVar[str] = "note"
    text: str
    tone: Tone = "warn"


@dataclass(frozen=True, slots=True)
class Table:
    """A table; columns whose name begins with ``>`` hold numbers."""

    kind: ClassVar[str] = "table"
    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]


@dataclass(frozen=True, slots=True)
class Figure:
    """A chart with its caption."""

    kind: ClassVar[str] = "figure"
    chart: Chart | RecordingChart
    caption: str


@dataclass(frozen=True, slots=True)
class CorrelationMatrix:
    """Correlations from -1 to 1, (k, k)."""

    kind: ClassVar[str] = "matrix"
    caption: str
    names: tuple[str, ...]
    short: tuple[str, ...]
    rows: tuple[tuple[float, ...], ...]


@dataclass(frozen=True, slots=True)
class NameValues:
    """Names with values."""

    kind: ClassVar[str] = "facts"
    facts: tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class FileText:
    """The text of a file, unchanged."""

    kind: ClassVar[str] = "code"
    text: str


@dataclass(frozen=True, slots=True)
class Collapsible:
    """Blocks that are closed until the reader opens them; print shows them open."""

    kind: ClassVar[str] = "fold"
    summary: str
    blocks: tuple[ReportBlock, ...]


ReportBlock = (
    Paragraph
    | WarningBox
    | Table
    | Figure
    | CorrelationMatrix
    | NameValues
    | FileText
    | Collapsible
)


@dataclass(frozen=True, slots=True)
class Section:
    """A part of the page with its heading."""

    id: str
    title: str
    blocks: tuple[ReportBlock, ...]


def table(
    caption: str, columns: Sequence[str], rows: Sequence[Sequence[str | Cell]]
) -> Table:
    """Build a table of texts and cells."""
    cells = tuple(
        tuple(c if isinstance(c, Cell) else Cell(c) for c in row) for row in rows
    )
    return Table(caption, tuple(columns), cells)


def foldable_table(
    caption: str,
    columns: Sequence[str],
    rows: Sequence[Sequence[str | Cell]],
    most: int,
) -> list[ReportBlock]:
    """A table of the first rows; the reader opens the rest."""
    first = table(caption, columns, rows[:most])
    if len(rows) <= most:
        return [first]
    rest = table(f"{caption}, continued", columns, rows[most:])
    return [first, Collapsible(f"{len(rows) - most} more", (rest,))]
