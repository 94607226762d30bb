"""Writing a session while it happens, so that a killed process loses next to nothing.

Samples go into an Arrow IPC stream, each batch complete in itself and handed to the
operating system at least every `FLUSH` seconds; marks are appended a line at a time. So
after a kill everything up to the last quarter of a second is there and can be read.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from time import monotonic, time
from typing import Any, Self

from fieldcal.errors import SessionError
from fieldcal.sample_files import to_batch
from fieldcal.samples import Block, concat
from fieldcal.session import DESCRIPTION, MARKS, write_whole

FLUSH = 0.2
"""Longest time that samples wait in memory, s of the host's clock."""

SAMPLES = "samples.arrows"


class Recorder:
    """The session folder of a run in progress; a context manager.

    Raises
    ------
    SessionError
        If the folder holds a session already: nothing is ever overwritten. Or, from any
        method, if the disk refuses.

    """

    def __init__(self, folder: Path, about: Mapping[str, Any]) -> None:
        import pyarrow as pa
        import tomlkit

        self.folder = folder
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if (folder / DESCRIPTION).exists() or (folder / SAMPLES).exists():
                raise SessionError(
                    f"{folder}: holds a session already; name another folder"
                )
            write_whole(folder / DESCRIPTION, tomlkit.dumps(about))
            self._samples = (folder / SAMPLES).open("xb", buffering=0)
            self._marks = (folder / MARKS).open("a", encoding="utf-8")
        except OSError as error:
            raise SessionError(f"{folder}: cannot be written: {error}") from error
        schema = to_batch(concat([])).schema
        self._stream = pa.ipc.new_stream(self._samples, schema)
        self._waiting: list[Block] = []
        self._written = monotonic()
        self._closed = False

    def append(self, block: Block) -> None:
        """Record samples, in SI units and device axes."""
        self._waiting.append(block)
        if monotonic() - self._written >= FLUSH:
            self.flush()

    def flush(self) -> None:
        """Hand what waits to the operating system."""
        self._written = monotonic()
        waiting, self._waiting = concat(self._waiting), []
        if len(waiting):
            try:
                self._stream.write_batch(to_batch(waiting))
            except OSError as error:
                raise self._refused(error) from error

    def mark(self, event: str, **what: Any) -> None:
        """Append a mark: what happened, with the host's time."""
        line = json.dumps({"event": event, **what, "host_s": round(time(), 3)})
        self.flush()
        try:
            self._marks.write(line + "\n")
            self._marks.flush()
            os.fsync(self._samples.fileno())
            os.fsync(self._marks.fileno())
        except OSError as error:
            raise self._refused(error) from error

    def close(self) -> None:
        """Write what waits and end the stream; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        try:
            self.flush()
            self._stream.close()
        finally:
            self._samples.close()
            self._marks.close()

    def _refused(self, error: OSError) -> SessionError:
        return SessionError(
            f"{self.folder}: cannot be written: {error}; what was recorded is kept"
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()
