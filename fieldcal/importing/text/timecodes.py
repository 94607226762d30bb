"""Time codes of film and video: frames behind the seconds, ``23:59:58:24``.

They count from 0 in each second, to one less than the frames of a second. Read as
hundredths they would leap at each second's end, so codes are what never shows more than
a frame can. Before the frames may stand a semicolon, where some codes are dropped so
that 29.97 frames a second keep to the clock. Source: www.dropframetimecode.org, of
SMPTE 12M and EBU.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Self

from fieldcal.importing.text.text_form import Reader, TextForm

RATES = (24, 25, 30, 48, 50, 60)
"""Frames of a second, as time codes count them."""

SECONDS, LINES = 3, 20
"""Whole seconds, and lines, that tell time codes."""

FEWEST = 3
"""Different frames that tell them."""

_CODE = re.compile(r"(?<![\d:;.,])(\d\d:\d\d:\d\d)([:;])(\d\d)(?![\d:;.])")


class Timecodes(TextForm):
    """Time codes as times with a part of a second."""

    def __init__(self, rate: int, sign: str) -> None:
        self._rate, self._sign = rate, sign
        self.says = f"its times are time codes of {rate} frames a second"
        if sign == ":":
            # where none is dropped, 30 may be 29.97
            self.says += (
                "; if they are 0.1 % fewer, as video has them, so are all its rates"
            )

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if each line has one such time, and none has a later part."""
        found = [said for line in lines if (said := _CODE.search(line)) is not None]
        if len(found) < max(LINES, len(lines) - LINES):
            return None
        signs = {said[2] for said in found}
        if len(signs) != 1 or (";" in signs and any(x.count(";") > 1 for x in lines)):
            return None
        ends: dict[str, int] = {}
        for said in found:
            ends[said[1]] = max(int(said[3]), ends.get(said[1], 0))
        rate = next((one for one in RATES if max(ends.values()) < one), None)
        # the first second and the last may be cut
        whole = [*ends.values()][1:-1]
        if rate is None or len(whole) < SECONDS or min(whole) < rate / 2:
            return None
        # two rows in a second have 00 and 50 hundredths
        if len({int(said[3]) for said in found}) < FEWEST:
            return None
        return cls(rate, signs.pop())

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""

        def one(line: str) -> str:
            said = _CODE.search(line)
            if said is None or said[2] != self._sign:
                return line
            part = f"{int(said[3]) / self._rate:.9f}"[1:]
            return f"{line[: said.start()]}{said[1]}{part}{line[said.end() :]}"

        return lambda lines: [one(line) for line in lines]
