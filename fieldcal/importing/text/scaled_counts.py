"""Counts below lines that say what one of them is, as logs of cameras have them.

tscale,0.001                       s in one of t
gscale,0.00053263221               rad/s in one of gx gy gz
ascale,0.00048828125               g in one of ax ay az
t,gx,gy,gz,ax,ay,az
0,39,86,183,-1137,-15689,-2986
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Self

from fieldcal.importing.text.text_form import Reader, TextForm
from fieldcal.importing.text.text_top import is_number

UNITS = {"t": "s", "g": "rad/s", "a": "g"}
"""Units of the numbers with their scales, by the first letter of both."""

_SCALE = re.compile(r"\s*([tga])scale\s*,\s*(\d+\.?\d*(?:[eE][-+]?\d+)?)\s*")
_CHANNEL = re.compile(r"t|[ga][xyz]")


class ScaledCounts(TextForm):
    """Columns whose scales stand above them.

    Parameters
    ----------
    names : of the columns
    scales : by the first letter of a name

    """

    def __init__(self, names: Sequence[str], scales: Mapping[str, float]) -> None:
        said = [_CHANNEL.fullmatch(name) and name[0] in scales for name in names]
        self._scales = [scales[n[0]] if has else 1.0
                        for n, has in zip(names, said, strict=True)]  # fmt: skip
        self.names = tuple(f"{n} [{UNITS[n[0]]}]" if has else n
                           for n, has in zip(names, said, strict=True))  # fmt: skip
        self.says = "lines above its numbers say what one count is"

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if such lines stand above a line of names."""
        scales: dict[str, float] = {}
        for line in lines:
            if (said := _SCALE.fullmatch(line)) is not None:
                scales[said[1]] = float(said[2])
                continue
            names = [cell.strip() for cell in line.split(",")]
            if len(scales) > 1 and names[0] == "t":
                return cls(names, scales) if all(scales.values()) else None
        return None

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""

        def one(line: str) -> str:
            row = line.split(",")
            if len(row) != len(self._scales) or not is_number(row[0], False):
                return line
            return ",".join(
                f"{float(cell) * scale:.15g}" if is_number(cell, False) else cell
                for cell, scale in zip(row, self._scales, strict=True)
            )

        return lambda lines: [one(line) for line in lines]
