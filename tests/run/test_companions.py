"""Several devices at once on one table: a session and a result for each."""

import json
import subprocess
import threading
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from processes import RUN, steady, turned

from fieldcal.cli import main
from fieldcal.commands.virtual_address import driver_address
from fieldcal.core.errors import FieldcalError, SessionError
from fieldcal.core.samples import Block
from fieldcal.drivers.driver import host_clock
from fieldcal.fleet.outcome import levels_of
from fieldcal.history.store import History
from fieldcal.run import companions
from fieldcal.run.companions import (
    ArrivalTimes,
    Companion,
    LeadRecorder,
    companion_folders,
    record_companions,
    refuse_recorded_companions,
)
from fieldcal.run.movers import VirtualMover
from fieldcal.session.folder import Session
from fieldcal.session.marks import read_marks
from fieldcal.session.recorder import Recorder
from fieldcal.sim_device import VirtualDevice
from fieldcal.sim_device.in_process import InProcess

LINKS = ["--serial xsens --rate 200", "--can slcan", "--mavlink tcpin:127.0.0.1:0"]
BIASES = ["0.2,-0.3,0.1", "-0.1,0.3,0.2", "0.3,0.1,-0.2"]


def led(
    devices: Sequence[VirtualMover],
    urls: Sequence[str],
    *options: str,
    killed_at: int | None = None,
) -> tuple[int, Any, str]:
    """A run of two positions in which somebody turns all devices when told to.

    Returns exit code, result, and the error of the last event.
    """
    run = [*RUN, "--headless", "--json", "--no-report", *options]
    if "--resume" not in options:
        run += ["two_position", "--level=0.001", "--angles=0.001"]
        run += ["--squareness=1e-5"]
        run += ["--seconds=12", "--latitude=50.45"]
    for url in urls:
        run += ["--device", url]
    told: dict[str, Any] = {}
    with subprocess.Popen(
        run, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stderr and process.stdout
        for line in process.stderr:
            told = json.loads(line)
            if told.get("event") == "place" and told["position"] == killed_at:
                process.kill()
                break
            if told.get("event") == "place":
                angles = [(0.0, 0.0), (45.0, 5.0)][told["position"]]
                turned(devices, *angles)
        out = process.stdout.read()
    return process.returncode, json.loads(out or "null"), str(told.get("error"))


def started(
    stack: ExitStack, folder: Path, *last: str, once: bool = True, number: int = 3
) -> tuple[list[VirtualMover], list[str]]:
    devices, urls = [], []
    for link, bias in zip(LINKS[:number], BIASES[:number], strict=True):
        options = [*link.split(), *steady(folder), "--speed=20", f"--acc-bias={bias}"]
        options += ["--latitude=50.45", "--height=0"]
        options += last if link == LINKS[-1] else ()
        devices.append(stack.enter_context(VirtualMover(options, once)))
        urls.append(driver_address(options, devices[-1].port))
    return devices, urls


def test_three_devices_on_three_links_have_a_session_and_a_result_each(
    tmp_path: Path,
) -> None:
    """And each is decided about by itself."""
    with ExitStack() as stack:
        devices, urls = started(stack, tmp_path, "--gyr-noise=0.02,0.02,0.02")
        serials = ["--serial", "A1", "--serial", "B1", "--history", str(tmp_path / "h")]
        code, result, said = led(devices, urls, *serials, "-o", str(tmp_path / "s"))
        truths = [device.truth for device in devices]
    assert code == 1, said
    check(tmp_path / "s", truths, urls, result, go=(True, True, False))
    assert result["decision"]["go"]
    assert "gyr_bias" in result["further"]["device-3"]["decision"]["reasons"][0]
    assert [row[:2] for row in History(tmp_path / "h").serials()] == [
        ("A1", 1),
        ("B1", 1),
    ]
    (kept,) = History(tmp_path / "h").runs("B1")
    assert kept.session == str(tmp_path / "s" / "device-2")
    assert kept.calibration.to_json() == result["further"]["device-2"]


@pytest.mark.thorough
def test_a_run_that_is_killed_goes_on_with_what_is_left(tmp_path: Path) -> None:
    """Nobody recorded the turn, and of two positions nothing else bears witness.

    The device may have been off meanwhile, and its biases other ones.
    """
    with ExitStack() as stack:
        devices, urls = started(stack, tmp_path, once=False, number=1)
        session = tmp_path / "s"
        led(devices, urls, "-o", str(session), killed_at=1)
        before = list(read_marks(session / "marks.jsonl"))
        assert not (session / "result.json").exists()
        code, result, said = led(devices, [], "--resume", str(session))
        truths = [device.truth for device in devices]
    assert code == 1, said
    reasons = result["decision"]["reasons"]
    (reason,) = [r for r in reasons if "is known to ±" not in r]
    assert "nothing would contradict it" in reason and "--verify" in reason
    check(session, truths, urls, result, go=(False,))
    taken = [m for m in before if m["event"] == "window"]
    after = [m for m in read_marks(session / "marks.jsonl") if m["event"] == "window"]
    assert [m["position"] for m in after] == [0, 1] and after[:1] == taken


@pytest.mark.thorough
def test_all_devices_are_gone_on_with_after_a_kill(tmp_path: Path) -> None:
    with ExitStack() as stack:
        devices, urls = started(stack, tmp_path, once=False)
        session = tmp_path / "s"
        led(devices, urls, "-o", str(session), killed_at=1)
        folder = session / "device-2"
        before = list(read_marks(folder / "marks.jsonl"))
        code, result, said = led(devices, [], "--resume", str(session))
        truths = [device.truth for device in devices]
    reasons = [
        each["decision"]["reasons"] for each in (result, *result["further"].values())
    ]
    assert code == 1, said
    for each in reasons:
        (reason,) = [one for one in each if "is known to ±" not in one]
        assert "nothing would contradict it" in reason
    check(session, truths, urls, result, go=(False, False, False))
    taken = [m for m in before if m["event"] == "window"]
    after = [m for m in read_marks(folder / "marks.jsonl") if m["event"] == "window"]
    assert len(taken) == 1 and after[0] == taken[0] and len(after) == 2


def check(
    root: Path,
    truths: Sequence[Any],
    urls: Sequence[str],
    result: Any,
    go: Sequence[bool] = (True, True, True),
) -> None:
    """Whether every device has its session, and a result that is right."""
    sessions = [root, *sorted(root.glob("device-*"))]
    names = ["s", "device-2", "device-3"]
    assert [path.name for path in sessions] == names[: len(truths)]
    for folder, truth, url, good in zip(sessions, truths, urls, go, strict=True):
        written = json.loads((folder / "result.json").read_text())
        for group in ("acc_bias", "acc_scale", "gyr_bias"):
            found = written["parameters"][group]
            off = np.subtract(found["value"], truth[group])
            assert np.abs(off / np.array(found["sigma"])).max() < 4.5, (folder, group)
        assert written["decision"]["go"] == good, written["decision"]["reasons"]
        session = Session.open(folder)
        assert not session.warnings and (np.diff(session.block.t) > 0).all()
        if folder != sessions[0]:
            assert session.about.device["address"] == url
            key = result["further"][folder.name]["parameters"]
            assert key == written["parameters"]


@pytest.mark.thorough
def test_a_further_device_that_fails_costs_the_others_nothing(tmp_path: Path) -> None:
    with ExitStack() as stack:
        devices, urls = started(stack, tmp_path)
        urls[1] += "&reconnect=0"
        devices[1].ask(fault={"silence_s": 1e6})
        code, result, said = led(devices, urls, "-o", str(tmp_path / "s"))
    assert code == 3
    assert said.startswith("device-2: ")
    assert said.endswith("; the other devices have their results")
    assert result["verdict"] == "good" and set(result["further"]) == {"device-3"}
    marks = Session.open(tmp_path / "s" / "device-2").marks()
    assert "failed" in {mark["event"] for mark in marks}


def test_a_first_device_that_says_nothing_leaves_no_session_of_the_others(
    tmp_path: Path,
) -> None:
    """The next attempt may have another device there, or another site."""
    call = ["run", "two_position", "--headless", "--level=0.01", "--angles=0.01"]
    call += ["-o", str(tmp_path / "s")]
    with ExitStack() as stack:
        devices, urls = started(stack, tmp_path, number=2)
        devices[0].ask(fault={"silence_s": 1e6})
        for url in urls:
            call += ["--device", url]
        assert main([*call, "--latitude=50.45"]) == 3
    assert not (tmp_path / "s").exists()
    with Recorder(tmp_path / "s" / "device-2", {"format": 1}) as recorder:
        recorder.append(Block.of(np.arange(9.0), np.zeros((9, 3))))
    with pytest.raises(SessionError, match="device-2: holds a session already"):
        refuse_recorded_companions(tmp_path / "s", 1)
    refuse_recorded_companions(tmp_path / "s", 0)
    assert len(Session.open(tmp_path / "s" / "device-2").block) == 9


def test_times_go_over_the_hosts_clock() -> None:
    times = ArrivalTimes()
    assert np.isnan(times.device_time(0.0))
    before = host_clock()
    times.add(Block.of(np.array([10.0]), np.zeros((1, 3))))
    assert before <= times.host_time(10.0) <= host_clock()


def test_whoever_records_may_be_late() -> None:
    """What counts is when samples were read."""
    times, acc = ArrivalTimes(), np.zeros((1, 3))
    for t, host in ((1.0, 500.0), (2.0, 501.0), (3.0, 502.5)):
        times.add(Block.of(np.array([t]), acc, t_host=np.array([host])))
    assert times.device_time(501.75) == pytest.approx(2.5)
    assert times.host_time(1.5) == pytest.approx(500.5)
    assert times.device_time(times.host_time(2.7)) == pytest.approx(2.7)


class Full(Recorder):
    """A session on a disk that is full."""

    def append(self, block: Block) -> Block:
        raise SessionError("the disk is full")

    def mark(self, event: str, **what: Any) -> None:
        raise SessionError("the disk is full")


def test_a_full_disk_ends_the_recording_of_a_device_without_a_traceback(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Which would be written across the screen of the operator."""
    broken: list[object] = []
    monkeypatch.setattr(threading, "excepthook", broken.append)
    with Full(tmp_path / "s", {"format": 1}) as recorder:
        companion = Companion(InProcess(VirtualDevice(seed=1)), recorder)
        companion.end()
    assert str(companion.failed) == "the disk is full" and not broken


class Recorded:
    """A further device, whose marks are kept."""

    failed, folder = None, Path("two")

    def __init__(self) -> None:
        self.marks: list[tuple[str, int]] = []

    def mark(self, event: str, **what: Any) -> None:
        self.marks.append((event, what["position"]))

    def window(self, position: int, span: Any, without: Any = ()) -> None:
        self.marks.append(("window", position))


def test_what_the_operator_discards_is_discarded_of_every_device(
    tmp_path: Path,
) -> None:
    other = Recorded()
    with Recorder(tmp_path / "s", {"format": 1}) as recorder:
        leads = LeadRecorder(recorder, [cast(Companion, other)])
        leads.append(Block.of(np.arange(9.0), np.zeros((9, 3))))
        leads.mark("asked", position=0, name="home")
        leads.mark("window", position=0, start_s=1.0, end_s=8.0)
        leads.mark("repeated", position=0)
        leads.mark("asked", position=0, name="home")
        leads.mark("skipped", position=0)
    events = ["asked", "window", "repeated", "asked", "skipped"]
    assert other.marks == [(event, 0) for event in events]


def test_what_the_first_device_has_the_others_have_whenever_it_is_killed(
    tmp_path: Path,
) -> None:
    """A window that is taken is not asked for again, a discarded one is."""
    own: list[str] = []

    class Own(Recorder):
        """The first device's session, whose marks are kept."""

        def mark(self, event: str, **what: Any) -> None:
            own.append(event)
            super().mark(event, **what)

    class Watching(Recorded):
        """A further device that looks at the first one's marks at each of its own."""

        def mark(self, event: str, **what: Any) -> None:
            self.marks.append((event, event in own))

        def window(self, position: int, span: Any, without: Any = ()) -> None:
            self.marks.append(("window", "window" in own))

    other = Watching()
    with Own(tmp_path / "s", {"format": 1}) as recorder:
        leads = LeadRecorder(recorder, [cast(Companion, other)])
        leads.append(Block.of(np.arange(9.0), np.zeros((9, 3))))
        leads.mark("window", position=0, start_s=1.0, end_s=8.0)
        leads.mark("repeated", position=0)
    assert other.marks == [("window", False), ("repeated", True)]


def test_a_device_that_joins_a_session_later_has_each_position_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Positions of a remedy are in the tables of the task, and marked as added."""
    monkeypatch.setattr(
        companions, "open_driver", lambda url: InProcess(VirtualDevice(seed=1))
    )
    planned = [
        {"alpha_deg": 0.0, "beta_deg": 0.0},
        {"alpha_deg": 45.0, "beta_deg": 5.0},
    ]
    besides = {"alpha_deg": -45.0, "beta_deg": 5.0}
    with Recorder(tmp_path / "s", {"format": 1, "position": planned}):
        pass
    with Recorder(tmp_path / "s", None) as recorder:
        tables = {"format": 1, "position": [*planned, besides]}
        tables |= {"device": {"lot": "7", "serial": "A1"}, "site": {"station": "B"}}
        with record_companions({"new:": ""}, recorder, tables) as leads:
            leads.mark("added", position=2, name="besides", **besides)
    for folder in (tmp_path / "s", *companion_folders(tmp_path / "s", 1)):
        assert [p.degrees for p in Session.open(folder).positions] == [
            (0.0, 0.0), (45.0, 5.0), (-45.0, 5.0)
        ]  # fmt: skip
    further = Session.open(companion_folders(tmp_path / "s", 1)[0])
    assert levels_of(further.about.raw) == {"lot": "7", "station": "B"}
    assert "serial" not in further.about.device


def test_an_unforeseen_error_of_a_further_device_is_told(tmp_path: Path) -> None:
    """Its recording is cut off there, and nothing may be calculated from it unsaid."""

    class Broken(InProcess):
        """Its wire format breaks on what it receives."""

        def receive(self, timeout: float) -> Block | None:
            raise ZeroDivisionError("of nothing")

    with Recorder(tmp_path / "s", {"format": 1}) as recorder:
        companion = Companion(Broken(VirtualDevice(seed=1)), recorder)
        companion.end()
    assert isinstance(companion.failed, FieldcalError)
    assert "ZeroDivisionError: of nothing" in str(companion.failed)
    (mark,) = [
        m for m in Session.open(tmp_path / "s").marks() if m["event"] == "failed"
    ]
    assert mark["text"] == str(companion.failed)
