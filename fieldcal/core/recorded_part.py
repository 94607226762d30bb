"""Part of a recording that a session uses, to recognise the same samples elsewhere.

A session may be uploaded or copied more than once, and solved with other facts. It
remains one recording: a repetition of its result is no second measurement.

>>> whole = RecordedPart("ab", 0.0, 90.0)
>>> whole.overlaps(RecordedPart("ab", 60.0, 120.0))
True
>>> whole.overlaps(RecordedPart("ab", 90.0, 120.0))
False
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class RecordedPart:
    """Part of a recording.

    Attributes
    ----------
    digest : SHA-256 of all samples of the recording, hexadecimal
    start, end : of the part that is used, s of device time

    """

    digest: str
    start: float
    end: float

    def overlaps(self, other: RecordedPart) -> bool:
        """Whether both use some of the same samples."""
        same = self.digest == other.digest
        return same and self.start < other.end and other.start < self.end
