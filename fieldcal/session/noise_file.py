"""noise.json of a session: the result of `fieldcal noise`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fieldcal.core.documents import load_json
from fieldcal.core.errors import SessionError
from fieldcal.session.schemas import schema_fault, validator

NOISE = "noise.json"


def read_noise(path: Path) -> Mapping[str, Any] | None:
    """Content of a noise.json, by its path or its session folder; None without one.

    Raises
    ------
    SessionError
        If it cannot be read, or does not conform to its schema.

    """
    file = path / NOISE if path.is_dir() else path
    try:
        content = load_json(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except OSError as error:
        raise SessionError(f"{file}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise SessionError(
            f"{file}: is no {NOISE}: {error}; name the folder of a session that has"
            " one, or run fieldcal noise again"
        ) from error
    if not isinstance(content, dict):
        raise SessionError(f"{file}: holds no JSON object; run fieldcal noise again")
    if wrong := schema_fault(content, validator("noise")):
        raise SessionError(f"{file}: {wrong}; run fieldcal noise again")
    return content
