"""The rooms of the code and what goes from one to the next, as one drawing."""

from __future__ import annotations

from html import escape
from typing import NamedTuple

COLUMN, ROW = 168, 78
"""Distance of the boxes, px."""

WIDTH, HEIGHT = 124, 40
"""Of a box, px."""

MARGIN = 8


class Box(NamedTuple):
    """A room, or something outside, at a place of the grid.

    `wide` is the number of columns it covers.
    """

    title: str
    column: int
    row: int
    wide: int = 1
    outside: bool = False


BOXES = {
    "device": Box("device", 0, 0, outside=True),
    "drivers": Box("drivers", 1, 0),
    "run": Box("run", 2, 0),
    "session": Box("session", 3, 0),
    "importing": Box("importing", 4, 0),
    "sim_device": Box("sim_device", 0, 1),
    "procedures": Box("procedures", 1, 1),
    "windows": Box("windows", 2, 1),
    "evaluation": Box("evaluation", 3, 1),
    "importers": Box("importers", 4, 1),
    "history": Box("history", 1, 2),
    "acceptance": Box("acceptance", 2, 2),
    "solve": Box("solve", 3, 2),
    "diagnosis": Box("diagnosis", 4, 2),
    "install": Box("install", 0, 3),
    "results": Box("result.json", 1, 3, outside=True),
    "model": Box("model", 2, 3, wide=2),
    "effects": Box("effects", 4, 3),
    "exporters": Box("exporters", 0, 4),
    "report": Box("report", 1, 4),
    "physics": Box("physics", 4, 4),
}
"""Rooms by name; `core` and `calibration` are used by all of them."""

ARROWS = (
    ("device", "drivers", "bytes"),
    ("drivers", "run", "samples"),
    ("run", "session", "samples"),
    ("importing", "session", ""),
    ("sim_device", "device", ""),
    ("procedures", "run", "steps"),
    ("run", "windows", ""),
    ("session", "evaluation", "samples"),
    ("importers", "importing", ""),
    ("evaluation", "windows", "means"),
    ("evaluation", "solve", "rows"),
    ("evaluation", "diagnosis", ""),
    ("solve", "acceptance", "values ±"),
    ("acceptance", "history", ""),
    ("acceptance", "results", ""),
    ("solve", "model", ""),
    ("diagnosis", "model", ""),
    ("effects", "model", "columns"),
    ("physics", "effects", ""),
    ("results", "install", ""),
    ("results", "exporters", ""),
    ("results", "report", ""),
)
"""What goes from where to where, and what it is."""


def drawing() -> str:
    """The whole of it, as HTML; it scales with the page."""
    across = COLUMN * max(b.column + b.wide for b in BOXES.values())
    down = ROW * (1 + max(b.row for b in BOXES.values()))
    width, height = across - COLUMN + WIDTH + 2 * MARGIN, down - ROW + HEIGHT
    parts = [_arrow(*arrow) for arrow in ARROWS] + [_box(b) for b in BOXES.values()]
    return (
        f'<svg viewBox="0 0 {width} {height + 2 * MARGIN}" role="img"'
        ' aria-label="From a device to a calibration" style="max-width:100%"'
        ' xmlns="http://www.w3.org/2000/svg">'
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7"'
        ' markerHeight="7" orient="auto"><path d="M0,0 L8,4 L0,8 z"'
        f' fill="currentColor"/></marker></defs>{"".join(parts)}</svg>'
    )


def _edges(box: Box) -> tuple[float, float, float, float]:
    left, top = MARGIN + COLUMN * box.column, MARGIN + ROW * box.row
    return left, top, left + COLUMN * (box.wide - 1) + WIDTH, top + HEIGHT


def _box(box: Box) -> str:
    left, top, right, bottom = _edges(box)
    look = 'fill="none" stroke-dasharray="4 3"' if box.outside else 'fill="#8aa0b8"'
    return (
        f'<rect x="{left}" y="{top}" width="{right - left}" height="{bottom - top}"'
        f' rx="5" {look} fill-opacity="0.35" stroke="currentColor"/>'
        f'<text x="{(left + right) / 2}" y="{(top + bottom) / 2 + 5}" font-size="14"'
        f' text-anchor="middle" fill="currentColor">{escape(box.title)}</text>'
    )


def _arrow(start: str, end: str, what: str) -> str:
    one, other = _edges(BOXES[start]), _edges(BOXES[end])
    x0, x1 = _nearest(one[0], one[2], other[0], other[2])
    y0, y1 = _nearest(one[1], one[3], other[1], other[3])
    line = (
        f'<line x1="{x0}" y1="{y0}" x2="{x1}" y2="{y1}" stroke="currentColor"'
        ' marker-end="url(#tip)"/>'
    )
    if not what:
        return line
    flat = y0 == y1
    x, y = (x0 + x1) / 2 + (0 if flat else 5), (y0 + y1) / 2 + (-4 if flat else 4)
    anchor = "middle" if flat else "start"
    return line + (
        f'<text x="{x}" y="{y}" font-size="11" text-anchor="{anchor}"'
        f' fill="currentColor">{escape(what)}</text>'
    )


def _nearest(
    low: float, high: float, to_low: float, to_high: float
) -> tuple[float, float]:
    """Where an arrow leaves one stretch and meets another, along one direction."""
    if high < to_low:
        return high, to_low
    if to_high < low:
        return low, to_high
    middle = (max(low, to_low) + min(high, to_high)) / 2
    return middle, middle
