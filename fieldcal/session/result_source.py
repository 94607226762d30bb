"""What of a session a result was made from, so that a later change is noticed.

A result that is older than what it was made from holds numbers of another recording or
another description. The times of the files do not tell that, as copies have their own.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from shlex import quote
from typing import Any

from fieldcal.calibration import Calibration
from fieldcal.core.errors import SessionError
from fieldcal.session import description_file
from fieldcal.session.folder import DESCRIPTION, RESULT
from fieldcal.session.sample_files import find_samples

MADE_FROM = "made_from"
"""Key of `result.json`."""


def made_from(folder: Path) -> dict[str, Any]:
    """What a result of a session is made from, as `result.json` states it.

    It is a digest of what session.toml says, whatever its layout and comments, and the
    size of the samples file, which only grows. Empty where these are not there.
    """
    try:
        about = description_file.read_description(folder / DESCRIPTION).raw
        size = find_samples(folder).stat().st_size
    except SessionError:
        return {}
    text = json.dumps(about, sort_keys=True, default=str)
    return {
        "description": hashlib.sha256(text.encode()).hexdigest()[:16],
        "samples_bytes": size,
    }


def with_source(calibration: Calibration, folder: Path) -> Calibration:
    """A calibration of a session that states what it was made from."""
    info = {**calibration.info, MADE_FROM: made_from(folder)}
    return replace(calibration, info=info)


def outdated_text(folder: Path, result: Mapping[str, Any]) -> str:
    """What is wrong with a result of a session that has changed since; else empty.

    Nothing is known of a result that does not say what it was made from, or whose
    recording is elsewhere.
    """
    before, now = result.get(MADE_FROM), made_from(folder)
    if not isinstance(before, Mapping) or not now or before == now:
        return ""
    longer = before.get("samples_bytes") != now["samples_bytes"]
    what = "samples were added or replaced" if longer else f"{DESCRIPTION} was changed"
    return (
        f"{folder / RESULT}: was made before {what}, so its numbers are not those of"
        f" this session: run fieldcal solve {quote(str(folder))} first"
    )
