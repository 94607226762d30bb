"""Part of a recording that a session uses, to recognise the same samples elsewhere.

A session may be uploaded or copied more than once, and solved with other facts. It
remains one recording: a repetition of its result is no second measurement. So does a
copy that was made before the run was continued, although it has fewer samples.

>>> whole = RecordedPart("ab", 0.0, 90.0)
>>> whole.overlaps(RecordedPart("ab", 60.0, 120.0))
True
>>> whole.overlaps(RecordedPart("ab", 90.0, 120.0))
False
>>> begun, continued = (RecordedPart(d, 0.0, 90.0, run="7f") for d in ("ab", "cd"))
>>> begun.overlaps(continued)
True
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
    samples : number of samples of the recording
    run : identifies the run that recorded it; None if unknown

    """

    digest: str
    start: float
    end: float
    samples: int = 0
    run: str | None = None

    def overlaps(self, other: RecordedPart) -> bool:
        """Whether both use some of the same samples."""
        same = self.digest == other.digest
        same = same or (self.run is not None and self.run == other.run)
        return same and self.start < other.end and other.start < self.end
