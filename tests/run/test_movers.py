"""Who turns the device: a command, a virtual device, and one that is gone."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import pytest
from processes import HANGS, script

from fieldcal.core.errors import InputError, MoverFailed, MoverGone, PlanError
from fieldcal.core.positions import FIVE_POSITIONS, Position
from fieldcal.run import retrying_mover
from fieldcal.run.command_mover import CommandMover
from fieldcal.run.movers import RunningDevice, VirtualMover
from fieldcal.run.retrying_mover import RetryingMover
from fieldcal.sim_device.control import Control


@pytest.fixture(params=["posix", "macos", "windows"])
def system(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Systems that cannot look without reaping, or know no groups of processes."""
    for name in {"macos": ["waitid"], "windows": ["waitid", "killpg"]}.get(
        request.param, []
    ):
        monkeypatch.delattr(os, name)
    return str(request.param)


def wait(mover: CommandMover) -> None:
    deadline = monotonic() + HANGS
    while mover.busy():
        assert monotonic() < deadline
        sleep(0.01)


@pytest.mark.usefixtures("system")
def test_a_command_is_called_with_the_position(tmp_path: Path) -> None:
    out = tmp_path / "said"
    call = script(tmp_path, f"import sys; open({str(out)!r}, 'w').write(str(sys.argv))")
    with CommandMover(call, HANGS) as mover:
        assert not mover.busy()
        mover.turn(FIVE_POSITIONS[3], 3)
        wait(mover)
    assert "'4', '45', '2.5', 'α = 45°, β = 2.5°'" in out.read_text()


@pytest.mark.usefixtures("system")
@pytest.mark.parametrize(
    ("body", "timeout", "says"),
    [
        (
            "import sys; sys.exit('axis 2 is stuck')",
            HANGS,
            "exit code 1: axis 2 is stu",
        ),
        ("import time; time.sleep(60)", 0.3, "was not done after 0.3 s"),
    ],
)
def test_a_command_that_fails_is_said(
    tmp_path: Path, body: str, timeout: float, says: str
) -> None:
    with CommandMover(script(tmp_path, body), timeout) as mover:
        mover.turn(Position.deg(1.0, 0.0), 0)
        with pytest.raises(MoverFailed, match=says):
            wait(mover)


def test_what_a_command_says_need_not_be_utf_8(tmp_path: Path) -> None:
    body = r"import sys; sys.stderr.buffer.write(b'T\374r offen\n'); sys.exit(3)"
    with CommandMover(script(tmp_path, body), HANGS) as mover:
        mover.turn(Position.deg(1.0, 0.0), 0)
        with pytest.raises(MoverFailed, match="exit code 3: T.r offen"):
            wait(mover)


@pytest.mark.parametrize(
    ("form", "argument"),
    [("{alpha}", "22.5"), ("{beta}", "-5"), ("{alpha:.3f}", "22.500"),
     ("{position}", "3"), ("p{position:02d}", "p03"), ("{name}", "α = 22.5°, β = -5°")],
)  # fmt: skip
def test_numbers_may_be_formatted(form: str, argument: str, tmp_path: Path) -> None:
    said = tmp_path / "said"
    body = f"import sys; open({str(said)!r}, 'w').write(sys.argv[-1])"
    with CommandMover([*script(tmp_path, body), form], HANGS) as mover:
        mover.turn(Position.deg(22.5, -5.0), 2)
        wait(mover)
    assert said.read_text() == argument


@pytest.mark.parametrize(
    "form",
    ["{alpha:{width}}", "{alpha!z}", "{position:.3q}", "{alpha:{beta.x}}",
     "{alpha:{beta[0]}}"],
)  # fmt: skip
def test_a_format_that_is_none_is_a_mistake_of_the_command(form: str) -> None:
    with pytest.raises(PlanError) as raised:
        CommandMover(["turn", form], 1.0)
    said = str(raised.value)
    assert said.startswith(f"[run.mover] command: {form!r} cannot be filled in (")
    assert said.endswith("write numbers as in {alpha:.3f} or {position:02d}")


def test_a_command_that_is_not_there_is_said() -> None:
    with (
        CommandMover(["/no/such/turntable"], 1.0) as mover,
        pytest.raises(MoverFailed, match="cannot be called"),
    ):
        mover.turn(FIVE_POSITIONS[0], 0)


@pytest.mark.parametrize("system", ["posix", "macos"], indirect=True)
@pytest.mark.usefixtures("system")
def test_all_that_a_command_has_started_ends_with_it(tmp_path: Path) -> None:
    """Also what outlives the command itself, such as a controller in the background."""
    pipe = tmp_path / "alive"
    os.mkfifo(pipe)
    for last in ("", "; time.sleep(600)"):
        child = f"exec 3>{pipe}; sleep 600"
        body = f"import subprocess, time; subprocess.Popen(['sh', '-c', {child!r}])"
        with (
            CommandMover(script(tmp_path, body + last), 600.0) as mover,
            ThreadPoolExecutor() as pool,
        ):
            mover.turn(FIVE_POSITIONS[0], 0)
            with pool.submit(open, pipe).result() as alive:  # the child has begun
                if not last:
                    wait(mover)
                mover.close()
                assert alive.read() == ""  # whoever could write is gone


def test_a_turn_that_is_asked_for_twice_is_not_broken_off(tmp_path: Path) -> None:
    """As after a gap of the link, while the table is on its way."""
    with CommandMover(script(tmp_path, "import time; time.sleep(600)"), 600.0) as mover:
        started = []
        for number in (0, 0, 1):
            mover.turn(FIVE_POSITIONS[number], number)
            assert mover._process is not None
            started.append(mover._process.pid)
    assert started[0] == started[1] != started[2]


class Gone:
    """A mover that is gone for some of its calls."""

    def __init__(self, fails: list[bool]) -> None:
        self.fails, self.turned = fails, 0

    def turn(self, position: Position, number: int = 0) -> None:
        self.turned += 1

    def busy(self) -> bool:
        if self.fails.pop(0):
            raise MoverGone("no answer")
        return False


def test_a_mover_that_is_gone_is_tried_again_like_a_device(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = [0.0]
    monkeypatch.setattr(retrying_mover, "monotonic", lambda: now[0])
    gone, told = Gone([True, True] + [False] * 20), list[str]()
    mover = RetryingMover(gone, 20.0)
    mover.tell = told.append
    mover.turn(FIVE_POSITIONS[0], 0)
    looks = []
    for _ in range(12):
        looks.append(mover.busy())
        now[0] += 1.0
    assert gone.turned == 3 and looks[-1] is False and not all(looks)
    assert told == ["no answer; tried again for 20 s"]
    for_ever = RetryingMover(Gone([True] * 50), 20.0)
    for_ever.turn(FIVE_POSITIONS[0], 0)
    with pytest.raises(MoverGone, match="no answer"):
        for _ in range(60):
            assert for_ever.busy()
            now[0] += 1.0


def test_a_virtual_device_that_listens_again_is_turned_again(tmp_path: Path) -> None:
    control = tmp_path / "control"
    turns: list[Any] = []

    def answer(request: dict[str, Any]) -> dict[str, Any]:
        turns.append(request["turn"])
        return {}

    def served(listening: Control) -> RunningDevice:
        device = RunningDevice(control)
        with ThreadPoolExecutor() as pool:
            turning = pool.submit(device.turn, FIVE_POSITIONS[0])
            while not turning.done():
                listening.serve()
        return device

    first = Control(answer, control)
    device = served(first)
    first.close()
    with pytest.raises(MoverGone, match="gone|failed"):
        device.turn(FIVE_POSITIONS[1])
    with pytest.raises(MoverGone, match="no virtual device listens"):
        device.turn(FIVE_POSITIONS[1])
    again = Control(answer, control)
    with ThreadPoolExecutor() as pool:
        turning = pool.submit(device.turn, FIVE_POSITIONS[1])
        while not turning.done():
            again.serve()
    device.close()
    again.close()
    assert len(turns) == 2


def test_options_that_a_virtual_device_refuses_are_wrong_usage() -> None:
    """Exit code 2 as of `fieldcal sim` itself: no device has failed."""
    with pytest.raises(InputError, match="--speed 'abc' must be a number above 0"):
        VirtualMover(["--speed", "abc"])
