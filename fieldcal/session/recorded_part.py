"""Which samples a session uses: a digest of the recording, and the span of its windows.

The digest is that of times, accelerometers and gyroscopes as the file has them, so it
is the same in a copy, in another format of samples, and with other facts in
session.toml. Several sessions may use different parts of one long recording.
"""

from __future__ import annotations

import hashlib
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
        windows = [w for w in Session.open(folder).windows if w is not None]
        digest, start, end = _digest_and_span(find_samples(folder))
    except (SessionError, OSError):
        return None
    if windows:
        start, end = min(w[0] for w in windows), max(w[1] for w in windows)
    return RecordedPart(digest, start, end)


def _digest_and_span(path: Path) -> tuple[str, float, float]:
    """Digest of all samples of a file, and their first and last instant, s."""
    made, start, end = hashlib.sha256(), np.inf, -np.inf
    for block in iterate_samples(path):
        rows = np.column_stack([block.t, block.six]).astype("<f8") + 0.0  # no -0.0
        rows[np.isnan(rows)] = np.nan  # a missing value has many bit patterns
        made.update(rows.tobytes())
        start, end = min(start, float(block.t[0])), max(end, float(block.t[-1]))
    return made.hexdigest(), start, float(np.nextafter(end, np.inf))
