"""Writing a session while it happens, so that a killed process loses next to nothing.

Samples go into an Arrow IPC stream, each batch complete in itself and handed to the
operating system at least every `FLUSH` seconds; marks are appended a line at a time. So
after a kill everything up to the last quarter of a second is there and can be read, and
a recording that broke off can be gone on with: what stands after its last whole batch
is cut off, and the next batch follows.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from time import monotonic, time
from typing import IO, Any, Self

import numpy as np

from fieldcal.errors import SessionError
from fieldcal.sample_files import read, to_batch, whole_batches
from fieldcal.samples import Block, concat
from fieldcal.session import DESCRIPTION, MARKS, write_whole

FLUSH = 0.2
"""Longest time that samples wait in memory, s of the host's clock."""

SAMPLES = "samples.arrows"

BREAK = 1.0
"""Least time that a break of the recording takes, s of device time."""

END = b"\xff\xff\xff\xff\0\0\0\0"
"""What an Arrow stream that was closed in order ends with."""


class Recorder:
    """The session folder of a run in progress; a context manager.

    Parameters
    ----------
    folder : where
    about : tables of session.toml; None goes on with a session that broke off

    Raises
    ------
    SessionError
        If the folder holds a session already, or none to go on with: nothing is ever
        overwritten. Or, from any method, if the disk refuses.

    """

    def __init__(self, folder: Path, about: Mapping[str, Any] | None) -> None:
        self.folder = folder
        self._last: tuple[float, float] | None = None
        self._shift, self._broken = 0.0, False
        self._waiting: list[Block] = []
        self._written = monotonic()
        self._closed = False
        try:
            self._samples = self._resume() if about is None else self._begin(about)
            self._marks = (folder / MARKS).open("a", encoding="utf-8")
        except OSError as error:
            raise SessionError(f"{folder}: cannot be written: {error}") from error

    def _begin(self, about: Mapping[str, Any]) -> IO[bytes]:
        import tomlkit

        self.folder.mkdir(parents=True, exist_ok=True)
        if (self.folder / DESCRIPTION).exists() or (self.folder / SAMPLES).exists():
            raise SessionError(
                f"{self.folder}: holds a session already; name another folder, or go on"
                " with it by --resume"
            )
        write_whole(self.folder / DESCRIPTION, tomlkit.dumps(about))
        return self._new()

    def _new(self) -> IO[bytes]:
        samples = (self.folder / SAMPLES).open("xb", buffering=0)
        samples.write(to_batch(concat([])).schema.serialize())
        return samples

    def _resume(self) -> IO[bytes]:
        """Cut off what is not whole, and go on behind it."""
        _cut_marks(self.folder / MARKS)
        path = self.folder / SAMPLES
        end, batches = whole_batches(path) if path.exists() else (0, 0)
        if not batches:
            path.unlink(missing_ok=True)
            return self._new()
        os.truncate(path, end)
        block, _ = read(path)
        self._last = (float(block.t[-1]), float(block.t_host[-1]))
        self.rejoin()
        return path.open("ab", buffering=0)

    def rejoin(self) -> None:
        """Take note that the link was opened anew: its clock may have begun anew."""
        self._shift, self._broken = 0.0, True

    def append(self, block: Block) -> Block:
        """Record samples, in SI units and device axes; returns them as recorded.

        The times of a device whose clock began anew go on from the last sample by what
        the host saw go by, so that they never run backwards.
        """
        if self._broken and self._last is not None:
            self._broken = False
            last, last_host = self._last
            away = float(block.t_host[0]) - last_host
            if block.t[0] < last + BREAK:
                away = away if np.isfinite(away) else BREAK
                self._shift = last + max(BREAK, away) - float(block.t[0])
                self.mark("rejoined", shift_s=self._shift)
        if self._shift:
            block = replace(block, t=block.t + self._shift)
        self._last = (float(block.t[-1]), float(block.t_host[-1]))
        self._waiting.append(block)
        if monotonic() - self._written >= FLUSH:
            self.flush()
        return block

    def flush(self) -> None:
        """Hand what waits to the operating system."""
        self._written = monotonic()
        waiting, self._waiting = concat(self._waiting), []
        if len(waiting):
            try:
                self._write(to_batch(waiting).serialize())
            except OSError as error:
                raise self._refused(error) from error

    def _write(self, data: Any) -> None:
        left = memoryview(data)
        while left.nbytes:
            left = left[self._samples.write(left) :]

    def mark(self, event: str, **what: Any) -> None:
        """Append a mark: what happened, with the host's time."""
        line = json.dumps({"event": event, **what, "host_s": round(time(), 3)})
        self.flush()
        try:
            # the samples first: a mark must never speak of what is not there
            os.fsync(self._samples.fileno())
            self._marks.write(line + "\n")
            self._marks.flush()
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
            self._write(END)
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


def _cut_marks(path: Path) -> None:
    """Cut off a last line that was not written whole."""
    data = path.read_bytes() if path.exists() else b""
    if data and not data.endswith(b"\n"):
        os.truncate(path, data.rfind(b"\n") + 1)
