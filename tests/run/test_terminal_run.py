"""The real console in a terminal of 80 by 24, and an operator who errs at it."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from time import monotonic

import numpy as np
import pexpect
import pyte
import pytest
from processes import HANGS, steady

from fieldcal.run.movers import VirtualMover
from fieldcal.session.marks import read_marks

SPEED = 16.0

DRAWN = re.escape("\x1b[H")
"""What each drawing of a screen begins with."""

SIM = ["--serial", "witmotion", "--speed", str(SPEED), "--seed", "4", "--rate", "50"]
SIM += ["--base-tilt=1,-0.5", "--latitude=50.45", "--height=170"]


@pytest.fixture
def device(tmp_path: Path) -> Iterator[VirtualMover]:
    link = tmp_path / "port"
    sim = [*SIM, *steady(tmp_path), "--port-link", str(link)]
    with VirtualMover(sim, once=False) as made:
        made.port = str(link)
        yield made


class Console:
    """`fieldcal run` in a terminal, and what was ever on its screen."""

    def __init__(self, device: VirtualMover, folder: Path, *more: str) -> None:
        self.device, self.folder = device, folder
        url = f"serial:{device.port}?format=witmotion"
        call = ["-m", "fieldcal", "run", "five_position", "--device", url]
        call += ["--angles", "0.001", "--no-report"]
        call += ["--seconds", "14", "--latitude", "50.45", "--height", "170"]
        call += ["-o", str(folder), *more]
        self.child = pexpect.spawn(
            sys.executable, call, dimensions=(24, 80), encoding="utf-8", timeout=HANGS
        )
        self._screen = pyte.Screen(80, 24)
        self._stream = pyte.Stream(self._screen)
        self.seen: list[str] = []
        self.bells = 0

    def look(self) -> str:
        """What stands on the screen now, as running text."""
        try:
            new = self.child.read_nonblocking(1 << 16, timeout=0.02)
        except (pexpect.TIMEOUT, pexpect.EOF):
            new = ""
        self.bells += new.count("\a")
        for drawn in filter(None, re.split(f"(?={DRAWN})", new)):
            self._stream.feed(drawn)
            text = self._text()
            if not self.seen or text != self.seen[-1]:
                self.seen.append(text)
        return self.seen[-1] if self.seen else ""

    def _text(self) -> str:
        lines = [line.strip("│╭╮╰╯─ ").strip() for line in self._screen.display]
        return re.sub(r"\s+", " ", " ".join(filter(None, lines)))

    def wait(self, *words: str) -> str:
        """Look until all words have stood there, however short a time; the text."""
        first, deadline = max(len(self.seen) - 1, 0), monotonic() + HANGS
        while monotonic() < deadline:
            self.look()
            for text in self.seen[first:]:
                if all(word in text for word in words):
                    return text
            first = max(len(self.seen) - 1, 0)
        raise AssertionError(f"{words} did not appear; the last was: {self.look()}")

    def turn(self, alpha: float, beta: float, **more: float) -> float:
        """Turn the device, as a hand does; device time at which it is there, s."""
        turn = {"alpha_deg": alpha, "beta_deg": beta, **more}
        return float(self.device.ask(turn=turn)["until_s"])

    def averaging(self) -> None:
        """Wait until a window has begun."""
        self.wait("H O L D S T I L L")
        deadline = monotonic() + HANGS
        while monotonic() < deadline:
            if (found := re.search(r"\] +(\d+)%", self.look())) and int(found[1]) > 5:
                return
        raise AssertionError(f"no window began: {self.look()}")

    def finish(self) -> int:
        """Read to the end; exit code."""
        while self.child.isalive():
            self.look()
        for _ in range(3):
            self.look()
        self.child.close()
        assert self.child.exitstatus is not None
        return int(self.child.exitstatus)


def asked(console: Console, number: int) -> None:
    """Wait until a position is asked for."""
    console.wait(f"position {number} of ")


def take(console: Console, number: int, alpha: float, beta: float) -> None:
    """Do as one is told."""
    asked(console, number)
    console.turn(alpha, beta)
    console.averaging()


def in_window(console: Console, alpha: float, beta: float) -> float:
    """Turn the device so slowly that it can be told in time what comes next.

    Returns:
        Device time amid the window that begins then, s, on the busiest machine as well.
    """
    return console.turn(alpha, beta, seconds=60.0) + 7.0


def wrong_angle(console: Console) -> None:
    asked(console, 2)
    console.turn(10.0, 0.0)
    console.wait("turn it by +12.")
    asked(console, 2)
    console.turn(22.5, 0.0)


def forgets_a_position(console: Console) -> None:
    asked(console, 3)
    console.turn(45.0, 2.5)
    console.wait("this is position 4, position 3 comes first")


def bump(console: Console) -> None:
    asked(console, 3)
    console.device.ask(bump={"at_s": in_window(console, 22.5, 2.5)})
    console.wait("hold still,")  # what was calm before is kept, or it starts again


def wrong_direction(console: Console) -> None:
    asked(console, 4)
    console.turn(-45.0, 2.5)
    console.wait("α is turned the wrong way")


def too_early(console: Console) -> None:
    console.turn(45.0, 5.0, at_s=in_window(console, 45.0, 2.5))
    console.wait("turned too early, position 4 is not done")
    console.turn(45.0, 2.5)


def walks_away(console: Console) -> None:
    asked(console, 5)
    console.wait("it has not been turned yet")
    console.wait("still waiting")
    console.turn(45.0, 5.0)


def third(console: Console) -> None:
    asked(console, 3)
    console.turn(22.5, 2.5)


def fourth(console: Console) -> None:
    asked(console, 4)
    console.turn(45.0, 2.5)


def fifth(console: Console) -> None:
    asked(console, 5)
    console.turn(45.0, 5.0)


WRONG_PLACES: list[Callable[[Console], None]] = [
    *(wrong_angle, forgets_a_position, third),
    *(wrong_direction, fourth, fifth),
]
ERRORS: list[Callable[[Console], None]] = [
    *(wrong_angle, forgets_a_position, bump),
    *(wrong_direction, too_early, walks_away),
]


@pytest.mark.parametrize(
    ("errors", "spoilt", "bells"),
    [
        (WRONG_PLACES, 0, 9),
        pytest.param(ERRORS, 2, 12, marks=pytest.mark.thorough),
    ],
    ids=["places", "all"],
)
def test_every_error_of_the_operator_is_said_and_the_result_is_right(
    device: VirtualMover,
    tmp_path: Path,
    errors: list[Callable[[Console], None]],
    spoilt: int,
    bells: int,
) -> None:
    console = Console(device, tmp_path / "s", "--verify")
    for err in errors:
        err(console)
    console.wait("position 6 of 6")
    console.turn(0.0, 5.0)
    console.wait("the device may be moved", "calculating GO or NO-GO ...")
    assert console.finish() == 0
    assert console.bells >= bells, "each step and each error rings"
    result = json.loads((tmp_path / "s" / "result.json").read_text())
    assert result["decision"]["go"]
    truth = {**device.truth, "base_tilt": [1.0, -0.5]}
    for group in ("acc_bias", "acc_scale", "gyr_bias", "base_tilt"):
        found = result["parameters"][group]
        pull = np.subtract(found["value"], truth[group]) / np.array(found["sigma"])
        assert np.abs(pull).max() < 4.5, group
    events = [m["event"] for m in read_marks(tmp_path / "s" / "marks.jsonl")]
    assert events.count("rejected") + events.count("kept") >= spoilt
    assert events.count("window") == 6


@pytest.mark.thorough
def test_keys_repeat_skip_and_stop_and_it_is_gone_on_with(
    device: VirtualMover, tmp_path: Path
) -> None:
    folder = tmp_path / "s"
    console = Console(device, folder)
    console.averaging()
    console.child.send("r")
    console.wait("[·")
    take(console, 2, 22.5, 0.0)
    device.ask(fault={"hangup_s": 2.5 * SPEED})
    console.wait("no samples come from", "goes on by itself")
    console.wait("hold still,")
    asked(console, 3)
    console.child.send("r")
    take(console, 2, 22.5, 0.0)
    asked(console, 3)
    console.child.send("s")
    console.wait("press s once more")
    console.child.send("s")
    asked(console, 4)
    console.child.send("q")
    assert console.finish() == 130
    assert "--resume" in console.seen[-1]
    marks = [m["event"] for m in read_marks(folder / "marks.jsonl")]
    assert marks.count("repeated") == 2 and marks.count("skipped") == 1
    call = ["-m", "fieldcal", "run", "--resume", str(folder), "--plain", "--no-report"]
    child = pexpect.spawn(sys.executable, call, encoding="utf-8")
    for number, angles in ((3, (22.5, 2.5)), (4, (45.0, 2.5)), (5, (45.0, 5.0))):
        child.expect(f"position {number}: turn to")
        device.ask(turn=dict(zip(("alpha_deg", "beta_deg"), angles, strict=True)))
    child.expect("GO: within all limits")
    child.expect(pexpect.EOF)
    child.close()
    assert child.exitstatus == 0


@pytest.mark.thorough
def test_a_wrong_place_is_taken_only_if_insisted_on_and_then_it_is_no_go(
    device: VirtualMover, tmp_path: Path
) -> None:
    console = Console(device, tmp_path / "s")
    console.averaging()
    asked(console, 2)
    console.turn(15.0, 0.0)
    console.wait("turn it by +7.")
    console.child.send("\r")
    assert console.wait("press Enter once more").count("turn it by") == 1
    console.turn(16.5, 0.0)  # not the place that was asked about
    console.wait("turn it by +6.")
    assert "press Enter" not in console.look()
    console.child.send("\r")
    console.wait("press Enter once more")
    console.child.send("\r")
    console.averaging()
    console.child.send("q")
    assert console.finish() == 130
    insisted = [
        m
        for m in read_marks(tmp_path / "s" / "marks.jsonl")
        if m["event"] == "insisted"
    ]
    assert len(insisted) == 1 and "turn it by" in insisted[0]["text"]
