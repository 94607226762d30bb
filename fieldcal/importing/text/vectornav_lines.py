"""Lines of a device by VectorNav, whose fields its manual names.

    $VNYMR,-131.192,+031.896,+008.488,-00.2816,...,+00.072580*62
    1715000000.123, $VNIMU,-00.2816,+00.2568,-00.1372,+05.354,...*5A

Before each line may stand when a computer received it. Source: VN-100 User Manual,
asynchronous ASCII messages YMR, QMR, MAR and IMU: accelerations are in m/s^2, rates in
rad/s, the temperature in deg C. Those of YBA lack gravity.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from functools import reduce
from operator import xor
from typing import Self

from fieldcal.importing.text.text_form import Reader, TextForm, is_true_of_most
from fieldcal.importing.times.clock_text import is_clock

_LINE = re.compile(r"(.*?)\$(VN([A-Z]{3}),[^*$]*)\*([0-9A-Fa-f]{2})\s*")

ACC = tuple(f"acc_{axis} [m/s^2]" for axis in "xyz")
GYR = tuple(f"gyr_{axis} [rad/s]" for axis in "xyz")
MAG = ("mag_x", "mag_y", "mag_z")

FIELDS = {
    "YMR": ("yaw", "pitch", "roll", *MAG, *ACC, *GYR),
    "QMR": ("quat_x", "quat_y", "quat_z", "quat_w", *MAG, *ACC, *GYR),
    "MAR": (*MAG, *ACC, *GYR),
    "IMU": (*MAG, *ACC, *GYR, "temperature [deg C]", "pressure"),
}
"""What a message holds, by its name."""

RECEIVED = "t"
"""Name of the time before a message."""


class VectorNavLines(TextForm):
    """Messages of a device by VectorNav, with the time before each if there is one."""

    gathers = True
    says = "its lines are those of a device by VectorNav"

    def __init__(self, message: str, timed: bool) -> None:
        self._message, self._timed = message, timed
        self.names = (*((RECEIVED,) if timed else ()), *FIELDS[message])

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if most lines have it."""
        rows = [row for line in lines if (row := _row(line)) is not None]
        if not is_true_of_most(lines, lambda line: "$VN" in line) or not rows:
            return None
        (message, _), *_ = Counter(row[0] for row in rows).most_common()
        mine = [row for row in rows if row[0] == message]
        return cls(message, sum(bool(row[1]) for row in mine) > len(mine) / 2)

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""

        def read(lines: Sequence[str]) -> list[str]:
            found = []
            for line in lines:
                row = _row(line)
                if row is None:
                    # a line that fails its check is no row: whoever reads rows says so
                    found.append(line)
                elif row[0] == self._message:
                    found.append(",".join(row[1:] if self._timed else row[2:]))
            return found

        return read


def _row(line: str) -> list[str] | None:
    """Name of a message, what stands before it, and its fields; None if it is none.

    >>> _row("0.5 $VNMAR,1,2,3,4,5,6,7,8,9*5B")
    ['MAR', '0.5', '1', '2', '3', '4', '5', '6', '7', '8', '9']
    """
    said = _LINE.fullmatch(line)
    if said is None or reduce(xor, said[2].encode(), 0) != int(said[4], 16):
        return None
    fields = [field.strip() for field in said[2].split(",")[1:]]
    if len(fields) != len(FIELDS.get(said[3], ())):
        return None
    return [said[3], _time(said[1]), *fields]


def _time(before: str) -> str:
    """The time that stands before a message, or nothing."""
    bare = before.removesuffix("->").strip(" \t,;:|>[]\"'-")
    number = re.fullmatch(r"\d+(?:\.\d+)?", bare)
    return bare if number or is_clock(bare) else ""
