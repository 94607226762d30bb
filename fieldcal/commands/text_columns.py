"""Columns of a text table, each as wide as its widest cell.

>>> print(*text_columns([["x", "1 ± 2"], ["long", "0.0000123 ± 0.0000012"]]), sep="|")
x                     1 ± 2|long  0.0000123 ± 0.0000012
"""

from __future__ import annotations

from collections.abc import Sequence

GAP = "  "
"""Between two columns: numbers must not run together."""


def text_columns(rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines of rows of equal length; the first column begins left, the others right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    out = []
    for first, *others in rows:
        cells = [cell.rjust(w) for cell, w in zip(others, widths[1:], strict=True)]
        out.append(GAP.join([first.ljust(widths[0]), *cells]).rstrip())
    return out
