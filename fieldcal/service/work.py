"""One job: makes a session from an upload, and documents from the session."""

from __future__ import annotations

import json
import re
import shutil
import signal
import subprocess
import sys
import threading
from dataclasses import dataclass, replace
from pathlib import Path

from fieldcal.core.errors import FieldcalError, InputError
from fieldcal.core.escaping import escape_invisible
from fieldcal.fleet.outcome import OUT_OF_MEMORY, SessionTask
from fieldcal.history.sessions import StoredSession
from fieldcal.report import gather, render
from fieldcal.run import junit
from fieldcal.service.bounds import MIB, ServiceBounds
from fieldcal.service.jobs import (
    JOB_FILE,
    RESULTS_FOLDER,
    SESSION_FOLDER,
    UPLOAD_FOLDER,
)
from fieldcal.service.limits import TimeUsedUp, resource_limits
from fieldcal.service.own_process import run_in_own_process
from fieldcal.service.records import station_record
from fieldcal.service.upload import archive_members, session_members, unpack
from fieldcal.session.file_writing import write_atomically
from fieldcal.session.folder import RESULT, Session
from fieldcal.session.integrity import DIAGNOSIS

IMPORT_OPTIONS = {
    name: f"--{name.replace('_', '-')}"
    for name in (
        *("serial", "name", "lot", "station", "operator", "latitude", "height"),
        *("gravity", "mounting", "columns", "rate", "acc_unit", "gyr_unit"),
        *("time_unit", "still", "instance", "grade"),
    )
}
"""Options of an upload, with the options of `fieldcal import` that they set."""

REPORT_FILE, JUNIT_FILE, RECORD_FILE = "report.html", "junit.xml", "record.json"

LONGEST_LOG = 20_000
"""Largest length of the kept output of the import, characters."""


@dataclass(frozen=True, slots=True)
class JobTask:
    """Processes the folder of a job.

    Attributes
    ----------
    bounds : of processor time and file sizes

    """

    bounds: ServiceBounds

    def __call__(self, folder: str) -> StoredSession:
        """Process a job; a failure is stated in ``error`` of the result."""
        if threading.current_thread() is not threading.main_thread():
            return run_in_own_process(self, folder)
        place = Path(folder)
        try:
            with resource_limits(self.bounds):
                one = self._processed(place)
        except FieldcalError as error:
            one = StoredSession(folder, error=str(error))
        except MemoryError:
            one = StoredSession(folder, error=self._memory_text)
        except OSError as error:
            said = f"a file cannot be written: {error.strerror}; send it again later"
            one = StoredSession(folder, error=said)
        except TimeUsedUp:
            one = StoredSession(folder, error=self._time_text)
        if one.error is None:
            return one
        return replace(one, error=without_paths(place, one.error))

    @property
    def _time_text(self) -> str:
        return (
            f"took more than {self.bounds.seconds / 60:g} min of processor time: send a"
            " shorter recording, or have the service started with more --minutes"
        )

    @property
    def _memory_text(self) -> str:
        return (
            f"needs more than {self.bounds.memory // MIB} MiB of memory: send a shorter"
            " recording, or have the service started with more --memory-mib"
        )

    def _processed(self, place: Path) -> StoredSession:
        session = self._session(place)
        one = SessionTask(diagnose=True)(str(session))
        if one.error is None:
            self._write(place, session, one)
        elif OUT_OF_MEMORY in one.error:
            raise MemoryError
        return one

    def _session(self, place: Path) -> Path:
        """Folder of the job's session; made unless it exists.

        Raises
        ------
        InputError
            If the upload is neither a session nor a recording.

        """
        there, part = place / SESSION_FOLDER, place / f".{SESSION_FOLDER}.part"
        if there.is_dir():
            return there
        shutil.rmtree(part, ignore_errors=True)
        job = json.loads((place / JOB_FILE).read_text("utf-8"))
        sent = place / UPLOAD_FOLDER / job["name"]
        found = archive_members(sent, self.bounds)
        files = session_members(found)
        if files is None:
            self._imported(sent, part, job["options"])
        elif job["options"]:
            raise InputError("a session says itself what it is of: leave options out")
        else:
            unpack(sent, files, part, self.bounds)
        part.rename(there)
        return there

    def _imported(self, sent: Path, part: Path, options: dict[str, str]) -> None:
        """Make a session from a recording, by `fieldcal import`."""
        said = [f"{IMPORT_OPTIONS[name]}={value}" for name, value in options.items()]
        call = [sys.executable, "-m", "fieldcal", "import", str(sent), "-o", str(part)]
        done = subprocess.run(
            [*call, *said], capture_output=True, check=False, cwd=sent.parent,
            stdin=subprocess.DEVNULL,
        )  # fmt: skip
        text = escape_invisible(done.stderr.decode("utf-8", "replace"))[-LONGEST_LOG:]
        text = without_paths(sent.parent.parent, text)
        write_atomically(sent.parent.parent / "import.log", text)
        if done.returncode:
            shutil.rmtree(part, ignore_errors=True)
            if done.returncode == -signal.SIGXCPU:
                raise InputError(self._time_text)
            if "MemoryError" in text:
                raise InputError(self._memory_text)
            last = text.strip().splitlines()[-1:] or ["import was killed"]
            raise InputError(last[0].removeprefix("fieldcal import: "))
        if not (part / "session.toml").is_file():
            raise InputError(
                "the recording has several IMUs: name one, as instance=NAME"
            )

    def _write(self, place: Path, session: Path, one: StoredSession) -> None:
        """Write all documents, atomically."""
        there, part = place / RESULTS_FOLDER, place / f".{RESULTS_FOLDER}.part"
        for old in (part, there):
            shutil.rmtree(old, ignore_errors=True)
        part.mkdir()
        opened = Session.open(session)
        for name, content in ((RESULT, one.result), (DIAGNOSIS, one.diagnosis)):
            if content is not None:
                shutil.copy(opened.write_json(name, content), part / name)
        write_atomically(part / REPORT_FILE, render(gather(session)))
        run = "run" in opened.about.raw
        held = opened.positions if run else ()
        junit.write(
            part / JUNIT_FILE, "session", held, list(opened.marks()), one.result
        )
        write_atomically(
            part / RECORD_FILE, json.dumps(station_record(one), indent=2) + "\n"
        )
        part.rename(there)


def without_paths(place: Path, text: str) -> str:
    """Text without the paths of this computer, of the folder of a job and of crashes.

    >>> without_paths(Path("/srv/1"), "/srv/1/upload/x: is bad; send in /tmp/a/b.txt")
    'x: is bad; send in b.txt'
    """
    inside = (
        rf"{re.escape(str(place))}/?(\.?{SESSION_FOLDER}(\.part)?/?|{UPLOAD_FOLDER}/)?"
    )
    text = re.sub(inside, "", text).removeprefix(": ")
    return re.sub(r"(?<![\w.^/)])/(?:[^/\s]+/)+(?=[^/\s])", "", text)
