"""The box as it should stand: its angles, drawn with the dots of braille letters.

α turns it about the axis to the north, clockwise for who looks north: its east side
goes down. β turns it about its own east axis, clockwise for who looks east: its north
side goes up. The arrow is the one that points up at home (-y). γ, where it is asked
for, turns it about its own vertical axis, clockwise for who looks from above, where the
arrow is the one that points north at home (z).
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.positions import Position
from fieldcal.core.samples import Array

COLUMNS, ROWS = 9, 4
"""Size of a picture, letters; a letter is two dots wide and four tall."""

BETWEEN = 3
"""Letters between two pictures."""

HALF = np.array([6.0, 3.0])
"""Half width and half height of the box, dots."""

ARROW = 7.0
"""Length of the arrow, dots."""

BITS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
"""Of the dots of a letter, by row and column."""

EMPTY_BRAILLE = 0x2800
"""The letter without dots."""


def draw_box(angle_deg: float) -> list[str]:
    """A box turned clockwise by an angle, four lines.

    >>> draw_box(0.0)[0].strip("⠀")
    '⢀⣤⣄'
    """
    a = np.deg2rad(angle_deg)
    turn = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])  # y is down
    w, h = HALF
    corners = np.array([[-w, -h], [w, -h], [w, h], [-w, h], [-w, -h]])
    tip, head = np.array([0.0, -ARROW]), np.array([[-2.0, -ARROW + 2], [2, -ARROW + 2]])
    lines = [*zip(corners[:-1], corners[1:], strict=True), (np.zeros(2), tip)]
    lines += [(tip, side) for side in head]
    dots = np.vstack([_line(*(turn @ end for end in line)) for line in lines])
    return _letters(dots)


def draw_joints(position: Position, width: int, height: int) -> list[str]:
    """All joints of a position, with what is seen.

    Side by side where there are so many letters, else two and below them the third; all
    or nothing, and nothing where they are not known.
    """
    if position.all_degrees is None:
        return []
    alpha, beta, gamma = position.all_degrees
    drawn = [[*draw_box(alpha), "α, facing N"], [*draw_box(beta), "β, facing E"]]
    if gamma:
        drawn.append([*draw_box(gamma), "γ, from above"])
    each = COLUMNS + BETWEEN
    for many in (len(drawn), 2):
        rows = [
            "".join(f"{line:<{each}}" for line in lines).rstrip()
            for first in range(0, len(drawn), many)
            for lines in zip(*drawn[first : first + many], strict=True)
        ]
        if max(map(len, rows)) <= width and len(rows) <= height:
            return rows
    return []


def _line(start: Array, end: Array) -> Array:
    """Dots between two points, (n, 2)."""
    part = np.linspace(0.0, 1.0, 32)[:, None]
    dots: Array = start + part * (end - start)
    return dots


def _letters(dots: Array) -> list[str]:
    middle = np.array([COLUMNS, 2 * ROWS]) - np.array([0.0, -0.5])
    at = np.rint(dots + middle).astype(int)
    grid = np.full((ROWS, COLUMNS), EMPTY_BRAILLE)
    inside = ((at >= 0) & (at < [2 * COLUMNS, 4 * ROWS])).all(axis=1)
    for x, y in np.unique(at[inside], axis=0):
        grid[y // 4, x // 2] |= BITS[y % 4, x % 2]
    return ["".join(map(chr, row)) for row in grid.tolist()]
