"""What a link survives and what it does not, through the command, on every link."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from pathlib import Path
from time import sleep
from typing import Any

import numpy as np
import pytest
from processes import TWO_POSITION, steady, turned, wait_for_samples

from fieldcal.commands.virtual_address import driver_address
from fieldcal.run.movers import VirtualMover
from fieldcal.session import sample_files
from fieldcal.session.folder import Session

LINKS = {
    "serial": "--serial xsens --port-link {0}/port",
    "text": "--serial text?checksum=xor --port-link {0}/port",
    "can": "--can slcan --port-link {0}/port",
    "mavlink": "--mavlink tcpin:127.0.0.1:0",
}
every_link = pytest.mark.parametrize(
    "link",
    [
        "serial",
        *(
            pytest.param(m, marks=pytest.mark.thorough)
            for m in ("can", "mavlink", "text")
        ),
    ],
)

POSITIONS = [(0.0, 0.0), (45.0, 5.0)]

SURVIVED: tuple[dict[str, float], ...] = (
    {"flip_bits": 5},
    {"lose_bytes": 5},
    {"double_bytes": 5},
    {"garbage_bytes": 200},
    {"duplicate_stamps": 3},
    {"late_stamps": 3},
    {"jitter_s": 0.02},
    {"jitter_s": 0},
    {"skew_ppm": 200},
    {"silence_s": 3},
    {"reboot_s": 2},
    {"hangup_s": 4},
)


class Run:
    """A calibration of a virtual device in other processes, and what came of it.

    The device is turned when it is asked for, so that nothing is over before all that
    should happen has happened, on a machine however slow.
    """

    def __init__(self, folder: Path, link: str, seconds: float = 10.0) -> None:
        self.folder = folder / "session"
        name, _, conceals = link.partition(" ")
        options = f"{LINKS[name].format(folder)} --speed 20 {conceals}".split()
        options += ["--latitude=50.45", "--height=0", *steady(folder)]
        self._device = VirtualMover(options, once=False)
        self.truth = self._device.truth
        self._process = subprocess.Popen(
            [*TWO_POSITION, f"--seconds={seconds}", "--latitude=50.45", "--json"]
            + [
                "--device",
                driver_address(options, self._device.port),
                "-o",
                str(self.folder),
            ],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        wait_for_samples(self.folder, self._process)

    def fault(self, *faults: dict[str, float]) -> None:
        for fault in faults:
            over = self._device.ask(fault=fault)["until_s"] + 0.5
            while over < 1e5 and self._device.ask(status={})["time_s"] < over:
                sleep(0.01)
            if "reboot_s" in fault:  # what is on the way is lost when it hangs up
                wait_for_samples(self.folder, self._process, self._recorded() + 4000)

    def _recorded(self) -> int:
        return (self.folder / "samples.arrows").stat().st_size

    def end(self) -> tuple[int, Any, str]:
        """Turn the device, then exit code, result, and last line of standard error."""
        assert self._process.stdout and self._process.stderr
        said = []
        for line in self._process.stderr:
            said.append(line.strip())
            told = json.loads(line)
            if told.get("event") == "place":
                turned([self._device], *POSITIONS[told["position"]])
        out = self._process.stdout.read()
        return self._process.wait(), json.loads(out or "null"), said[-1]

    def __enter__(self) -> Run:
        return self

    def __exit__(self, *exc: object) -> None:
        self._process.kill()  # if it is not over by itself
        self._process.communicate()
        self._device.close()

    def marks(self, event: str) -> list[dict[str, Any]]:
        return [m for m in Session.open(self.folder).marks() if m["event"] == event]


Ended = tuple[Run, int, Any, str]
"""A run, its exit code, its result, and the last line of what it said."""


def stumbles(folder: Path, link: str) -> Ended:
    with Run(folder, link) as run:
        run.fault(*SURVIVED)
        return run, *run.end()


@pytest.fixture(scope="module")
def several(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[dict[str, Future[Any]]]:
    """All runs that tests of this module ask for, by name: mostly they wait."""
    wanted = {item.name for item in request.session.items}
    work: dict[str, Callable[[Path], Any]] = {
        f"test_a_link_that_stumbles_costs_nothing_but_time[{link}]": partial(
            stumbles, link=link
        )
        for link in LINKS
    }
    for link, fault, _ in ENDS:
        name = f"test_what_ends_a_run_is_one_sentence[{link}-{fault}]"
        work[name] = partial(ended, link=link, fault=fault)
    # no more than two: a device that runs late is no fault of its link
    with ThreadPoolExecutor(2) as pool:
        yield {
            name: pool.submit(do, tmp_path_factory.mktemp("run"))
            for name, do in work.items()
            if name in wanted
        }


@every_link
def test_a_link_that_stumbles_costs_nothing_but_time(
    several: dict[str, Future[Ended]], request: pytest.FixtureRequest, link: str
) -> None:
    run, code, result, said = several[request.node.name].result()
    # the numbers are right, and if too many frames were refused, it is no link to use
    failed = [c["name"] for c in result["decision"]["checks"] if c["ok"] is False]
    assert code == bool(failed) and result["verdict"] == "good", said
    assert all(name.startswith("link: ") for name in failed), failed
    for group in ("acc_bias", "acc_scale", "gyr_bias"):
        found, truth = result["parameters"][group], run.truth[group]
        if "installed" in result and group == "gyr_bias":
            # an autopilot averages them when it starts: what is left is not all of it
            parts = [result["install"][f"INS_GYROFFS_{axis}"] for axis in "XYZ"]
            found = {key: [p[key] for p in parts] for key in ("value", "sigma")}
        pull = np.subtract(found["value"], truth) / np.array(found["sigma"])
        assert np.abs(pull).max() < 4.5, group
    block, _, _ = sample_files.read_samples(sample_files.find_samples(run.folder))
    assert (np.diff(block.t) > 0).all()
    marks = run.marks("link")
    counts = {
        name: sum(mark.get(name, 0) for mark in marks)
        for name in ("gaps", "missing", "repeated", "restarts", "bad")
    }
    assert counts["gaps"] >= 3 and counts["restarts"] >= 1 and counts["missing"] > 500
    assert counts["repeated"] >= 3
    # each long gap in the samples is marked where it is
    for at in np.flatnonzero(np.diff(block.t) > 1.5):
        gap = [m for m in marks if abs(m.get("from_s", -9) - block.t[at]) < 1e-3]
        assert len(gap) == 1 and abs(gap[0]["to_s"] - block.t[at + 1]) < 1e-3


@pytest.mark.thorough
def test_a_link_that_loses_all_the_time_is_marked_now_and_then(tmp_path: Path) -> None:
    with Run(tmp_path, "serial --with dropped:fraction=0.05", 4.0) as run:
        code, result, said = run.end()
    reasons = result["decision"]["reasons"]  # windows of 4 s may miss a limit as well
    assert code == 1 and any("samples missing" in one for one in reasons), said
    marks, block = run.marks("link"), Session.open(run.folder).block
    lost = sum(mark["missing"] for mark in marks)
    share = lost / (lost + len(block))
    assert 0.03 < share < 0.07
    seconds = marks[-1]["host_s"] - marks[0]["host_s"]
    assert 1 <= len(marks) <= seconds + 2


def failed(
    device: VirtualMover, url: str, folder: Path, *faults: dict[str, float]
) -> tuple[int, str]:
    """Exit code and error of a run in whose midst faults happen."""
    run = subprocess.Popen(
        [*TWO_POSITION, "--device", url, "-o", str(folder), "--patience", "0"],
        stderr=subprocess.PIPE,
        text=True,
    )
    wait_for_samples(folder, run)
    for fault in faults:
        device.ask(fault=fault)
    _, said = run.communicate()
    return run.returncode, str(json.loads(said.splitlines()[-1])["error"])


def kept(folder: Path, said: str) -> None:
    """What came before is in the session, and so is what was said."""
    session = Session.open(folder)
    assert len(session.block) > 50
    (mark,) = [m for m in session.marks() if m["event"] == "failed"]
    assert said.endswith(mark["text"]) and ". " not in mark["text"]


SILENT = "went silent for 3 s: not a byte came; check"
GONE = "hung up: check cable and power, then start again"


ENDS = [
    ("serial", "silence_s", SILENT),
    ("can", "silence_s", "went silent for 3 s: not a frame came; check"),
    ("mavlink", "silence_s", "went silent for 3 s: an autopilot is there, but"),
    ("mavlink", "reboot_s", "went silent for 3 s: an autopilot is there, but"),
    ("serial", "hangup_s", GONE),
    ("can", "hangup_s", GONE),
    ("mavlink", "hangup_s", GONE),
]


def ended(folder: Path, link: str, fault: str) -> tuple[Path, int, str]:
    """Session, exit code and last line of a run that a fault ends."""
    options = [*LINKS[link].format(folder).split(), "--speed", "20"]
    with VirtualMover(options) as device:
        url = driver_address(options, device.port) + "&reconnect=0"
        code, said = failed(device, url, folder / "s", {fault: 1e6})
    return folder / "s", code, said


LONG = {("mavlink", "silence_s"), ("mavlink", "hangup_s"), ("can", "hangup_s")}
"""On the way of another fault of the same link, or of this fault of another link."""


@pytest.mark.parametrize(
    ("link", "fault", "says"),
    [
        pytest.param(*one, marks=[pytest.mark.thorough] if one[:2] in LONG else [])
        for one in ENDS
    ],
    ids=[f"{link}-{fault}" for link, fault, _ in ENDS],
)
def test_what_ends_a_run_is_one_sentence(
    several: dict[str, Future[tuple[Path, int, str]]],
    request: pytest.FixtureRequest,
    link: str,
    fault: str,
    says: str,
) -> None:
    session, code, said = several[request.node.name].result()
    assert code == 3 and says in said, said
    kept(session, said)
