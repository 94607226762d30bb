"""Which samples a session uses: a digest of the recording, and the span of its windows.

The digest is that of times, accelerometers and gyroscopes as the file has them, so it
is the same in a copy, in another format of samples, and with other facts in
session.toml. Several sessions may use different parts of one long recording.

A run that is continued has more samples than a copy of it made before, so its digest is
another. Both have the id that the recorder wrote, and the same first sample: a
session.toml that was copied to other samples does not make these a copy.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fieldcal.core.errors import SessionError
from fieldcal.core.recorded_part import RecordedPart
from fieldcal.session.folder import Session
from fieldcal.session.sample_files import find_samples, iterate_samples


def recorded_part(folder: Path) -> RecordedPart | None:
    """Samples that a session uses, from its first window to its last.

    Without windows it is the whole recording. None if the session cannot be read.
    """
    try:
        session = Session.open(folder)
        windows = [w for w in session.windows if w is not None]
        whole = _whole_recording(find_samples(folder), session.about.recording_id)
    except (SessionError, OSError):
        return None
    if not windows:
        return whole
    start, end = min(w[0] for w in windows), max(w[1] for w in windows)
    return replace(whole, start=start, end=end)


def same_recording(folders: Sequence[Path]) -> tuple[int, int] | None:
    """Numbers of the first two sessions that use the same samples; None if none do."""
    parts = [recorded_part(folder) for folder in folders] if len(folders) > 1 else []
    for j, one in enumerate(parts):
        for i, other in enumerate(parts[:j]):
            if one and other and one.overlaps(other):
                return i, j
    return None


def _whole_recording(path: Path, recording_id: str) -> RecordedPart:
    """All samples of a file, of the run with an id; empty if it has none."""
    made, first = hashlib.sha256(), b""
    start, end, count = np.inf, -np.inf, 0
    for block in iterate_samples(path):
        rows = np.column_stack([block.t, block.six]).astype("<f8") + 0.0  # no -0.0
        rows[np.isnan(rows)] = np.nan  # a missing value has many bit patterns
        made.update(rows.tobytes())
        first = first or rows[0].tobytes()
        start, end = min(start, float(block.t[0])), max(end, float(block.t[-1]))
        count += len(block)
    end = float(np.nextafter(end, np.inf))
    run = hashlib.sha256(recording_id.encode() + first).hexdigest()
    return RecordedPart(
        made.hexdigest(), start, end, count, run if recording_id else None
    )
