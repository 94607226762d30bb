"""Letters three lines tall, for instructions that are read from where the device is.

Each letter is drawn on a grid of five rows; two rows share a line of text by half
blocks, so that a letter is about as wide as it is tall.
"""

from __future__ import annotations

from collections.abc import Sequence

HALVES = {(0, 0): " ", (1, 0): "▀", (0, 1): "▄", (1, 1): "█"}
"""Upper and lower half of a cell."""

ROWS = 6
"""Rows of the grid, the last of which is empty."""

GRIDS = """
A .#. #.# ### #.# #.#
D ##. #.# #.# #.# ##.
E ### #.. ##. #.. ###
F ### #.. ##. #.. #..
H #.# #.# ### #.# #.#
I # # # # #
K #.# #.# ##. #.# #.#
L #.. #.. #.. #.. ###
M #...# ##.## #.#.# #...# #...#
N #..# ##.# #.## #..# #..#
O ### #.# #.# #.# ###
P ### #.# ### #.. #..
R ##. #.# ##. #.# #.#
S ### #.. ### ..# ###
T ### .#. .#. .#. .#.
U #.# #.# #.# #.# ###
W #...# #...# #.#.# ##.## #...#
0 ### #.# #.# #.# ###
1 .#. ##. .#. .#. ###
2 ### ..# ### #.. ###
3 ### ..# .## ..# ###
4 #.# #.# ### ..# ..#
5 ### #.. ### ..# ###
6 ### #.. ### #.# ###
7 ### ..# ..# .#. .#.
8 ### #.# ### #.# ###
9 ### #.# ### ..# ###
. . . . . #
- ... ... ### ... ...
° ## ## .. .. ..
α .... .#.# #.#. #.#. .#.#
β ##. #.# ##. #.# ###
γ #.# #.# .#. .#. .#.
"""

GLYPHS = {row[0]: row[2:].split() for row in GRIDS.strip().splitlines()}


def can_draw(text: str) -> bool:
    """Whether there is a letter for each character."""
    return set(text) <= GLYPHS.keys() | {" "}


def draw_large(text: str) -> list[str]:
    """Draw a text in three lines of equal length.

    >>> [line.rstrip() for line in draw_large("TO")]
    ['▀█▀ █▀█', ' █  █ █', ' ▀  ▀▀▀']
    """
    grids = [GLYPHS.get(character, [".."] * 5) for character in text]
    return [_line(grids, row) for row in range(0, ROWS, 2)]


def _line(grids: Sequence[Sequence[str]], row: int) -> str:
    """Two rows of all letters as one line."""
    empty = "." * 9
    cells = []
    for grid in grids:
        lower = grid[row + 1] if row + 1 < len(grid) else empty
        pairs = zip(grid[row], lower, strict=False)
        cells.append("".join(HALVES[a == "#", b == "#"] for a, b in pairs))
    return " ".join(cells)
