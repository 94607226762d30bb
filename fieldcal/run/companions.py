"""Further devices on the same table, each recorded as a session of its own.

The procedure is carried out on the first device. The others are only recorded, each in
its own thread, so that none waits for another. A window of the first device holds for
all of them: its ends are converted by the host's clock into the time of each device,

    t_n = f_n^-1(f_1(t_1)),  f_k(t) = host time of device k's sample at t

piecewise linear between the batches of samples. The host time is that at which a batch
was read, which may be some hundredths of a second late. This does not matter, since the
device rests for a while before its window begins, and is not turned before the window
is marked.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from threading import Lock, Thread
from typing import Any

import numpy as np

from fieldcal.core.errors import DeviceError, FieldcalError, SessionError
from fieldcal.core.factory import FACTORY_KEYS
from fieldcal.core.samples import Block
from fieldcal.drivers.driver import Driver, host_clock, open_driver
from fieldcal.run.link_marks import LinkMarks
from fieldcal.session.folder import DESCRIPTION, Session
from fieldcal.session.marks import POSITION_ADDED
from fieldcal.session.recorder import Recorder

SHARED_KEYS = ("grade", "lot", *FACTORY_KEYS)
"""Keys of the first device's table that are copied to the further ones."""

MOST_BATCHES = 1 << 17
"""Number of batches whose times are kept: more than an hour."""


Span = tuple[float, float]
"""Start and end, s."""


class ArrivalTimes:
    """Host arrival times of the samples."""

    def __init__(self) -> None:
        self._pairs: deque[tuple[float, float]] = deque(maxlen=MOST_BATCHES)

    def add(self, block: Block) -> None:
        """Take samples that follow; unknown arrival times are set to the present."""
        arrived = float(block.t_host[-1])
        host = arrived if np.isfinite(arrived) else host_clock()
        self._pairs.append((float(block.t[-1]), host))

    @property
    def known(self) -> bool:
        """Whether any samples have arrived."""
        return bool(self._pairs)

    def host_time(self, t: float) -> float:
        """Host time of a device time."""
        times, hosts = np.array(self._pairs).T
        return float(np.interp(t, times, hosts))

    def device_time(self, host: float) -> float:
        """Device time of a host time; nan before there are samples."""
        if not self._pairs:
            return np.nan
        times, hosts = np.array(self._pairs).T
        return float(np.interp(host, hosts, times))


class Companion:
    """A further device that is recorded while the first goes through a procedure.

    Attributes
    ----------
    folder : its session
    failed : what ended its recording before its time, None if nothing did

    """

    def __init__(self, driver: Driver, recorder: Recorder) -> None:
        self.folder = recorder.folder
        self.failed: FieldcalError | None = None
        self._driver, self._recorder = driver, recorder
        self._lock, self._times, self._ends = Lock(), ArrivalTimes(), False
        if driver.notes:
            recorder.mark("device", **driver.notes)
        self._thread = Thread(target=self._run, name=f"record {driver.name}")
        self._thread.start()

    def mark(self, event: str, **what: Any) -> None:
        """Append a mark to its session."""
        with self._lock:
            self._recorder.mark(event, **what)

    def window(self, position: int, span: Span, without: Sequence[Span] = ()) -> None:
        """Mark a window between two host times, less some stretches, s."""
        with self._lock:
            first, last = (self._times.device_time(t) for t in span)
            gaps = [[self._times.device_time(t) for t in gap] for gap in without]
        if last > first:
            end_s = float(np.nextafter(last, np.inf))
            more = {"without_s": gaps} if gaps else {}
            self.mark("window", position=position, start_s=first, end_s=end_s, **more)
            self._driver.read_again()

    def end(self) -> None:
        """End the recording; safe to call twice."""
        self._ends = True
        self._thread.join()

    def _run(self) -> None:
        marks = LinkMarks(self._driver, self)
        try:
            for block in self._driver.blocks():
                with self._lock:
                    recorded = self._recorder.append(block)
                    self._times.add(recorded)
                marks.take(recorded)
                if self._ends and not self._driver.read_back.pending:
                    break
            marks.end()
        except FieldcalError as fault:
            # what was only just silent when all was over has been heard enough
            if not (self._ends and self._times.known):
                self._fail(fault)
        except Exception as fault:
            # nobody waits for this thread: what ends it must not end in silence
            what = f"{type(fault).__name__}: {fault}"
            self._fail(DeviceError(f"its recording broke on {what}; please report it"))

    def _fail(self, fault: FieldcalError) -> None:
        self.failed = fault
        with suppress(SessionError):  # a disk that is full takes no mark either
            self.mark("failed", text=str(fault))


class LeadRecorder:
    """Records the first device; its windows are those of the companions.

    Parameters
    ----------
    recorder : its own
    others : the further devices

    Attributes
    ----------
    folder : session of the first device
    tell : called once with a sentence for each companion that fails

    """

    def __init__(self, recorder: Recorder, others: Sequence[Companion]) -> None:
        self._recorder, self.others = recorder, others
        self.folder = recorder.folder
        self._times = ArrivalTimes()
        self._told: set[Path] = set()
        self.tell: Callable[[str], None] = lambda text: None

    def append(self, block: Block) -> Block:
        """Record samples of the first device; returns them as recorded."""
        recorded = self._recorder.append(block)
        self._times.add(recorded)
        for other in self.others:
            if other.failed is not None and other.folder not in self._told:
                self._told.add(other.folder)
                self.tell(f"{other.folder.name}: {other.failed}")
        return recorded

    def link_reopened(self) -> None:
        """Take note that the link of the first device was opened anew."""
        self._recorder.link_reopened()

    def mark(self, event: str, **what: Any) -> None:
        """Append a mark to all sessions that it concerns.

        Whenever the process is killed, what the first device's session says is taken,
        the others have as well: its window comes last, its discard first.
        """
        if event == "repeated":
            self._recorder.mark(event, **what)
        for other in self.others:
            if event in ("asked", "insisted", "repeated", "skipped", POSITION_ADDED):
                other.mark(event, **what)
            elif event == "window":
                host = self._times.host_time
                gaps = [(host(a), host(b)) for a, b in what.get("without_s", ())]
                span = (host(what["start_s"]), host(what["end_s"]))
                other.window(what["position"], span, gaps)
        if event != "repeated":
            self._recorder.mark(event, **what)


def companion_folders(folder: Path, number: int) -> list[Path]:
    """Sessions of so many further devices in the session of the first one."""
    return [folder / f"device-{2 + i}" for i in range(number)]


def refuse_recorded_companions(folder: Path, number: int) -> None:
    """Refuse a folder for a new run in which a further device has a session already.

    Raises
    ------
    SessionError
        Naming that session: its device and site may be others.

    """
    for each in companion_folders(folder, number):
        if (each / DESCRIPTION).exists():
            raise SessionError(
                f"{each}: holds a session already; name another folder (-o)"
            )


@contextmanager
def record_companions(
    further: Mapping[str, str], recorder: Recorder, about: Mapping[str, Any]
) -> Iterator[LeadRecorder]:
    """Record further devices into ``device-2``, ``device-3``, … of a session.

    A session that is there already is gone on with.

    Parameters
    ----------
    further : serial numbers of the further devices by their addresses; empty for none
    recorder : of the first device
    about : tables of the session, which hold for all but the device's name

    Raises
    ------
    DeviceError
        If one of them cannot be opened.

    """
    with ExitStack() as stack:
        others: list[Companion] = []
        folders = companion_folders(recorder.folder, len(further))
        # what the first session has by now: a position added later is marked in both
        known = len(Session.open(recorder.folder).positions)
        about = {**about, "position": list(about.get("position", ()))[:known]}
        for folder, (url, serial) in zip(folders, further.items(), strict=True):
            driver = stack.enter_context(open_driver(url))
            device: dict[str, Any] = {
                "name": folder.name.replace("-", " "),
                "address": url,
            }
            if serial:
                device["serial"] = serial
            lead = about.get("device", {})
            device |= {key: lead[key] for key in SHARED_KEYS if key in lead}
            begun = (folder / DESCRIPTION).exists()
            tables = None if begun else {**about, "device": device}
            own = stack.enter_context(Recorder(folder, tables))
            others.append(Companion(driver, own))
            stack.callback(others[-1].end)
        yield LeadRecorder(recorder, others)
