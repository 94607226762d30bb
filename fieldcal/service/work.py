"""One job: what was sent becomes a session, and the session its documents."""

from __future__ import annotations

import json
import re
import resource
import shutil
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path

from fieldcal.core.errors import FieldcalError, InputError
from fieldcal.core.escaping import escape_invisible
from fieldcal.fleet.outcome import SessionTask
from fieldcal.history.sessions import StoredSession
from fieldcal.report import gather, render
from fieldcal.run import junit
from fieldcal.service.bounds import Bounds
from fieldcal.service.jobs import JOB, RESULTS, SESSION, UPLOAD
from fieldcal.service.records import record
from fieldcal.service.upload import members, session_members, unpack
from fieldcal.session.folder import RESULT, Session, write_atomically
from fieldcal.session.integrity import DIAGNOSIS

OPTIONS = {
    name: f"--{name.replace('_', '-')}"
    for name in (
        *("serial", "name", "lot", "station", "operator", "latitude", "height"),
        *("gravity", "mounting", "columns", "rate", "acc_unit", "gyr_unit"),
        *("time_unit", "still", "instance", "grade"),
    )
}
"""What may be said of a recording, as options of `fieldcal import`."""

REPORT, JUNIT, RECORD = "report.html", "junit.xml", "record.json"

LOG = 20_000
"""Letters that are kept of what import said."""


@dataclass(frozen=True, slots=True)
class JobTask:
    """What is done with the folder of a job.

    Attributes
    ----------
    bounds : what it may use

    """

    bounds: Bounds

    def __call__(self, folder: str) -> StoredSession:
        """Carry it out; what is wrong with it is in the error."""
        place = Path(folder)
        try:
            self._limit()
            session = self._session(place)
        except FieldcalError as error:
            return StoredSession(folder, error=_within(place, str(error)))
        one = SessionTask(diagnose=True)(str(session))
        if one.error is not None:
            return replace(one, error=_within(place, one.error))
        self._write(place, session, one)
        return one

    def _limit(self) -> None:
        """Bound what this process may use; it does one job and is over."""
        used = resource.getrusage(resource.RUSAGE_SELF)
        spent = int(used.ru_utime + used.ru_stime)
        for what, most in (
            (resource.RLIMIT_CPU, spent + self.bounds.seconds),
            (resource.RLIMIT_FSIZE, 2 * self.bounds.unpacked),
            (resource.RLIMIT_CORE, 0),
        ):
            _, hard = resource.getrlimit(what)
            least = most if hard == resource.RLIM_INFINITY else min(most, hard)
            resource.setrlimit(what, (least, hard))

    def _session(self, place: Path) -> Path:
        """The session of a job, made where it is not there yet.

        Raises
        ------
        InputError
            If nothing can be made of what was sent.

        """
        there, part = place / SESSION, place / f".{SESSION}.part"
        if there.is_dir():
            return there
        shutil.rmtree(part, ignore_errors=True)
        job = json.loads((place / JOB).read_text("utf-8"))
        sent = place / UPLOAD / job["name"]
        found = members(sent, self.bounds)
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
        """Make a session of a recording, by `fieldcal import`."""
        said = [f"{OPTIONS[name]}={value}" for name, value in options.items()]
        call = [sys.executable, "-m", "fieldcal", "import", str(sent), "-o", str(part)]
        done = subprocess.run(
            [*call, *said], capture_output=True, check=False, cwd=sent.parent,
            stdin=subprocess.DEVNULL,
        )  # fmt: skip
        text = escape_invisible(done.stderr.decode("utf-8", "replace"))[-LOG:]
        write_atomically(sent.parent.parent / "import.log", text)
        if done.returncode:
            shutil.rmtree(part, ignore_errors=True)
            last = text.strip().splitlines()[-1:] or ["import was killed"]
            raise InputError(last[0].removeprefix("fieldcal import: "))
        if not (part / "session.toml").is_file():
            raise InputError(
                "the recording has several IMUs: name one, as instance=NAME"
            )

    def _write(self, place: Path, session: Path, one: StoredSession) -> None:
        """Write the documents, all of them or none."""
        there, part = place / RESULTS, place / f".{RESULTS}.part"
        for old in (part, there):
            shutil.rmtree(old, ignore_errors=True)
        part.mkdir()
        opened = Session.open(session)
        for name, content in ((RESULT, one.result), (DIAGNOSIS, one.diagnosis)):
            if content is not None:
                shutil.copy(opened.write_json(name, content), part / name)
        write_atomically(part / REPORT, render(gather(session)))
        run = "run" in opened.about.raw
        held = opened.positions if run else ()
        junit.write(part / JUNIT, "session", held, list(opened.marks()), one.result)
        write_atomically(part / RECORD, json.dumps(record(one), indent=2) + "\n")
        part.rename(there)


def _within(place: Path, text: str) -> str:
    """A sentence without where on this computer things are."""
    inside = rf"{re.escape(str(place))}/?(\.?{SESSION}(\.part)?/?|{UPLOAD}/)?"
    return re.sub(inside, "", text).removeprefix(": ")
