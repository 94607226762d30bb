"""XML and HTML: elements that are records, and tables.

    <sample t="0.01"><acc x="0.1" y="0.2" z="9.8"/><gyro x="0" y="0" z="0"/></sample>
    <trkpt lat="48.1" lon="11.5"><time>2024-05-03T12:00:00.01Z</time>
    <extensions><ax>0.1</ax>…                          as devices write tracks in GPX
    <tr><td>0.01</td><td>0.1</td>…                     data frames as pandas shows them
    <Row><Cell><Data ss:Type="Number">0.01</Data></Cell>…     workbooks as XML

What lies within is named with what it lies in, as in JSON.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from fieldcal.importers.json_log import CUT_OFF, JsonLog
from fieldcal.importing.records.markup import NAME, read_markup

WHAT = "XML and HTML: elements or tables"

DECLARED = re.compile(
    rb"\s*(?:\xef\xbb\xbf)?\s*<(?:\?xml|!doctype html|html|table)\b", re.I
)
ELEMENT = re.compile(rf"\s*<{NAME}(?:\s+{NAME}\s*=\s*[\"'][^<>]*)?/?>".encode())
"""An element with or without attributes; it is one only where something ends one."""


def recognises(head: bytes, path: Path) -> bool:
    """Whether a file begins like one."""
    if DECLARED.match(head) is not None:
        return True
    ends = b"</" in head or b"/>" in head
    return ends and ELEMENT.match(head) is not None


class MarkupLog(JsonLog):
    """Elements or tables, with one IMU in them or several."""

    def _document(self, text: str) -> Any:
        """What the text holds.

        Raises
        ------
        InputError
            If it is not whole.

        """
        found = read_markup(text)
        if found.is_cut:
            self.damaged("its end", CUT_OFF)
        return found.contents
