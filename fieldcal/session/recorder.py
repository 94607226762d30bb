"""Records a session; a killed process loses less than a second of samples.

Samples go into an Arrow IPC stream, each batch complete in itself, with its checksum,
and handed to the operating system at least every `FLUSH_INTERVAL` seconds, also while
the device is silent. Every `SYNC_INTERVAL` seconds they are written to the disk. Marks
are appended one line at a time, each with its checksum. Both files grow by whole pieces
only: a piece that is written in part is removed. So after a kill everything up to the
last fifth of a second can be read, and an interrupted recording can be continued: what
follows its last whole batch is cut off, and the next batch is appended. The session has
a random id from its beginning, by which its copies are known whenever they were made.

All writing is done in one thread of its own. A Ctrl-C may come between any two
instructions of the main thread: it ends the waiting for a piece to be written, and
never comes between its bytes and what is remembered of them.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from threading import Event, Lock, Thread
from time import monotonic, time
from typing import Any, Self
from uuid import uuid4

import numpy as np

from fieldcal.core.errors import SessionError, disk_says
from fieldcal.core.file_names import refuse_undecodable_path
from fieldcal.core.samples import Block, concat
from fieldcal.session.append_only_file import AppendOnlyFile
from fieldcal.session.file_writing import write_atomically
from fieldcal.session.folder import DESCRIPTION
from fieldcal.session.lock import SessionLock
from fieldcal.session.marks import MARKS, mark_line, read_marks, taken_windows
from fieldcal.session.sample_files import ENDINGS, read_samples
from fieldcal.session.sample_table import samples_schema, to_record_batch
from fieldcal.session.stream_damage import MARKER, no_samples_text

FLUSH_INTERVAL = 0.2
"""Longest time that samples are kept in memory only, s of the host's clock."""

SYNC_INTERVAL = 1.0
"""Longest time after which samples are on the disk, s; a power cut loses no more."""

CLOSE_WITHIN_S = 5.0
"""Time after which a Ctrl-C ends also the waiting for a disk to take the rest, s."""

SAMPLES = "samples.arrows"


LEAST_BREAK = 1.0
"""Least gap in the times after a lost link, s of device time."""


class Recorder:
    """The session folder of a run in progress; a context manager.

    Parameters
    ----------
    folder : path of the folder
    about : tables of session.toml; None continues an interrupted session

    Raises
    ------
    SessionError
        If the folder holds a session already: nothing is ever overwritten. If its path
        is not UTF-8, or another process records into it. From any method, if the disk
        cannot be written.

    """

    def __init__(self, folder: Path, about: Mapping[str, Any] | None) -> None:
        self.folder = folder
        self._last: tuple[float, float] | None = None
        self._shift, self._broken = 0.0, False
        self._unwritten = b""
        self._waiting: list[Block] = []
        self._lock = Lock()
        self._fault: OSError | None = None
        self._written = monotonic()
        self._stop, self._closed = Event(), False
        self._ended = False
        self._failed: Exception | None = None
        self._writer = ThreadPoolExecutor(1, "recorder writes")
        try:
            self._open(about)
        except FileExistsError as error:
            holds = "holds a session already; name another folder, or go on with it by"
            said = f"{holds} --resume" if folder.is_dir() else "is no folder; name one"
            raise SessionError(f"{folder}: {said}") from error
        except OSError as error:
            raise SessionError(
                f"{folder}: cannot be written: {disk_says(error)}"
            ) from error
        self._watch = Thread(target=self._keep_up, daemon=True, name="recorder")
        self._watch.start()

    def _open(self, about: Mapping[str, Any] | None) -> None:
        """Lock the folder and open its files; if that fails, leave it as it was."""
        refuse_undecodable_path(self.folder)
        new = not self.folder.exists()
        if about is not None:
            self.folder.mkdir(parents=True, exist_ok=True)
        try:
            self._held = SessionLock(self.folder)
            try:
                if about is None:
                    self._resume()
                else:
                    self._begin(about)
            except BaseException:
                self._held.release()
                raise
        except BaseException:
            if new:
                with contextlib.suppress(OSError):
                    self.folder.rmdir()
            raise

    def _begin(self, about: Mapping[str, Any]) -> None:
        import tomlkit

        from fieldcal.session.arrow_encoder import ArrowEncoder

        names = (DESCRIPTION, SAMPLES, MARKS)
        if any((self.folder / name).exists() for name in names):
            raise FileExistsError
        self._samples = AppendOnlyFile(self.folder / SAMPLES)
        # that of a plan which is a session.toml is another run's
        whole = {**about, "recording": {"id": uuid4().hex}}
        try:
            write_atomically(self.folder / DESCRIPTION, tomlkit.dumps(whole))
            self._marks = AppendOnlyFile(self.folder / MARKS)
        except BaseException:
            # empty files must not prevent the next attempt
            self._samples.close()
            for name in names:
                (self.folder / name).unlink(missing_ok=True)
            raise
        self._encoder = ArrowEncoder(samples_schema())

    def _resume(self) -> None:
        """Cut off an incomplete batch at the end and append after it.

        Raises
        ------
        SessionError
            If samples are there of which none can be read, or in a file that a run does
            not write.

        """
        from fieldcal.session.arrow_encoder import ArrowEncoder
        from fieldcal.session.arrow_stream import decode_stream

        path = self.folder / SAMPLES
        for ending in ENDINGS:
            other = self.folder / f"samples{ending}"
            if other != path and other.is_file():
                raise SessionError(
                    f"{other}: a run goes on with {SAMPLES} only, and a session has one"
                    " samples file: begin a new run, or solve this session as it is"
                )
        data = path.read_bytes() if path.exists() else b""
        found = decode_stream(data, samples_schema())
        if found.batches:
            self._encoder = ArrowEncoder(samples_schema(), found.number, found.row)
            block = read_samples(path).block
            self._last = (float(block.t[-1]), float(block.t_host[-1]))
            self.link_reopened()
        else:
            self._refuse_unreadable(path, data)
            self._encoder = ArrowEncoder(samples_schema())
        self._samples = AppendOnlyFile(path, found.end)
        marks = self.folder / MARKS
        lines = marks.read_bytes() if marks.exists() else b""
        self._marks = AppendOnlyFile(marks, lines.rfind(b"\n") + 1)

    def _refuse_unreadable(self, path: Path, data: bytes) -> None:
        """Refuse to write over samples that cannot be read, but could be restored.

        The beginning of a first batch, as of a run that was killed, is no such file.
        """
        begun = not data or data.startswith(MARKER)
        if not begun and taken_windows(read_marks(self.folder / MARKS)):
            raise SessionError(
                f"{path}: {no_samples_text(data)}; to take all positions of this"
                " session anew, delete this file first"
            )

    def link_reopened(self) -> None:
        """Note that the link was opened again: the device may have restarted."""
        self._shift, self._broken = 0.0, True

    def append(self, block: Block) -> Block:
        """Record samples, in SI units and device axes; returns them as recorded.

        If the device's clock restarted, its times are shifted to continue from the last
        sample by the time that passed on the host, so that they never decrease.
        """
        if self._broken and self._last is not None:
            self._broken = False
            last, last_host = self._last
            away = float(block.t_host[0]) - last_host
            if block.t[0] < last + LEAST_BREAK:
                away = away if np.isfinite(away) else LEAST_BREAK
                self._shift = last + max(LEAST_BREAK, away) - float(block.t[0])
                self.mark("rejoined", shift_s=self._shift)
        if self._shift:
            block = replace(block, t=block.t + self._shift)
        self._last = (float(block.t[-1]), float(block.t_host[-1]))
        with self._lock:
            self._waiting.append(block)
        if self._fault:
            raise self._refused(self._fault) from self._fault
        if monotonic() - self._written >= FLUSH_INTERVAL:
            self.flush()
        return block

    def flush(self) -> None:
        """Hand waiting samples to the operating system."""
        self._in_writer(self._write_samples)

    def _in_writer(self, write: Callable[[], None]) -> None:
        """Let the writing thread do something, behind what it does already."""
        self._writer.submit(write).result()

    def _write_samples(self) -> None:
        self._written = monotonic()
        with self._lock:
            blocks, self._waiting = self._waiting, []
        if not blocks and not self._unwritten:
            return
        waiting = concat(blocks)
        if len(waiting):
            # kept until written, so that nothing is lost if writing fails
            self._unwritten += self._encoder.encode(to_record_batch(waiting))
        try:
            self._samples.append(self._unwritten)
            self._unwritten = b""
        except OSError as error:
            self._fault = error
            raise self._refused(error) from error
        self._fault = None

    def mark(self, event: str, **what: Any) -> None:
        """Append a mark: an event with the host's time.

        A ``device`` mark also gets the time of the last sample before it.
        """
        if event == "device" and self._last is not None:
            what["at_s"] = self._last[0]
        line = mark_line({"event": event, **what, "host_s": round(time(), 3)})
        self._in_writer(lambda: self._write_mark(line.encode()))

    def _write_mark(self, line: bytes) -> None:
        # the samples first: a mark must not refer to samples that are not stored
        self._write_samples()
        try:
            self._samples.sync()
            self._marks.append(line)
            self._marks.sync()
        except OSError as error:
            raise self._refused(error) from error

    def close(self) -> None:
        """Write the remaining samples and end the stream; safe to call twice.

        A Ctrl-C meanwhile is raised once that is done, or if it takes too long.
        """
        if self._closed:
            return
        pressed: BaseException | None = None
        began = monotonic()
        while not self._closed:
            try:
                self._finish()
            except KeyboardInterrupt as ctrl_c:
                pressed = ctrl_c
                if monotonic() - began > CLOSE_WITHIN_S:
                    raise
        if raised := self._failed or pressed:
            raise raised

    def _finish(self) -> None:
        """Close; once interrupted it can be done again, and goes on from there."""
        self._stop.set()
        self._watch.join()
        if not self._ended:
            self._in_writer(self._end)
        self._writer.shutdown()
        self._held.release()
        self._closed = True

    def _end(self) -> None:
        """Write the rest and close the files; in the writing thread, and once."""
        if self._ended:
            return
        try:
            self._write_end()
        except Exception as error:
            self._failed = error  # raised by whoever closes, also if interrupted
        self._ended = True

    def _write_end(self) -> None:
        told = self._fault is not None
        try:
            self._write_samples()
            self._samples.append(self._encoder.end())
            self._samples.sync()
        except OSError as error:
            raise self._refused(error) from error
        except SessionError:
            if not told:
                raise
        finally:
            self._samples.close()
            self._marks.close()

    def _keep_up(self) -> None:
        """Flush and sync in the background; the next call raises what failed here."""
        synced = monotonic()
        while not self._stop.wait(FLUSH_INTERVAL / 2):
            try:
                if monotonic() - self._written >= FLUSH_INTERVAL:
                    self.flush()
                if monotonic() - synced >= SYNC_INTERVAL:
                    self._samples.sync()
                    synced = monotonic()
            except SessionError:
                pass
            except OSError as error:
                self._fault = error

    def _refused(self, error: OSError) -> SessionError:
        return SessionError(
            f"{self.folder}: cannot be written: {disk_says(error)}; what was recorded"
            " is kept"
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()
