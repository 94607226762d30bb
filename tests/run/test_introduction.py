"""The device introduces itself: up, what it sends, the line to use next time."""

from __future__ import annotations

import os
import sys
from argparse import Namespace
from collections.abc import Iterator
from contextlib import ExitStack, nullcontext
from pathlib import Path

import numpy as np
import pytest
from talking import talking

from fieldcal.cli import main
from fieldcal.commands import ports, run
from fieldcal.commands.find_device import find_device
from fieldcal.core.errors import InputError, Stopped
from fieldcal.core.samples import Array, Block, split_by_time
from fieldcal.run.introduction import introduce_device, rate_unit_from_turn
from fieldcal.run.movers import VirtualMover
from fieldcal.run.plan_file import PlanTask

N = 200


def at_rest(f: Array, bias: Array, seed: int = 0) -> Block:
    """Two seconds of a device that lies still, 100 Hz."""
    rng = np.random.default_rng(seed)
    acc = f + 0.02 * rng.standard_normal((N, 3))
    gyr = bias + 2e-3 * rng.standard_normal((N, 3))
    return Block.of(np.arange(N) / 100, acc, gyr)


@pytest.mark.parametrize(
    ("f", "up", "mounting"),
    [
        ((0.1, -9.79, 0.1), "-y", ("+x", "+y", "+z")),
        ((0.2, 0.1, 9.75), "+z", ("+x", "-z", "+y")),
        ((9.9, 0.1, 0.3), "+x", None),
        ((5.0, 5.0, 6.8), "", ("+x", "+y", "+z")),
    ],
)
def test_gravity_says_which_way_is_up(
    f: tuple[float, ...], up: str, mounting: tuple[str, ...] | None
) -> None:
    known = introduce_device(at_rest(np.array(f), np.array([0.01, -0.02, 0.03])), 9.81)
    assert known.up == up and not known.rates_zeroed
    assert mounting is None or known.mounting == mounting
    assert (f"{up} is up" if up else "it stands askew") in known.summary


def test_units_that_are_not_g_are_said() -> None:
    known = introduce_device(
        at_rest(np.array([0.0, -1.0, 0.0]), np.full(3, 0.01)), 9.81
    )
    assert not known.up and "m/s² at rest, and gravity is 9.81 m/s²" in known.summary


@pytest.mark.parametrize("axes", [slice(None), slice(1, 2)])
def test_a_device_that_lacks_accelerometers_is_said(axes: slice) -> None:
    block = at_rest(np.array([0.0, -9.81, 0.0]), np.full(3, 0.01))
    block.acc[:, axes] = np.nan
    known = introduce_device(block, 9.81)
    assert not known.up and "no accelerations along all three axes" in known.summary


def test_a_device_that_takes_its_bias_out_is_seen() -> None:
    f = np.array([0.0, -9.81, 0.0])
    centred = at_rest(f, np.zeros(3))
    centred = Block.of(centred.t, centred.acc, centred.gyr - centred.gyr.mean(axis=0))
    assert "takes their bias out itself" in introduce_device(centred, 9.81).summary
    zeros = Block.of(
        centred.t, centred.acc, np.zeros((N, 3))
    )  # while it thinks it rests
    assert "takes their bias out itself" in introduce_device(zeros, 9.81).summary
    assert not introduce_device(zeros, 9.81, bias_stated=True).rates_zeroed
    stuck = Block.of(centred.t, centred.acc, np.full((N, 3), 0.01))
    assert not introduce_device(stuck, 9.81).rates_zeroed
    assert (
        "bias out" not in introduce_device(at_rest(f, np.full(3, 0.01)), 9.81).summary
    )


@pytest.mark.parametrize(("scale", "unit"), [(1.0, "rad/s"), (180 / np.pi, "deg/s")])
def test_one_turn_by_hand_tells_the_unit(scale: float, unit: str) -> None:
    rng = np.random.default_rng(3)
    t = np.arange(1500) / 100
    rate = np.deg2rad(30.0) * (((t > 4) & (t < 6)) * 1.0 - ((t > 7) & (t < 9)) * 1.0)
    angle = np.cumsum(rate) / 100
    acc = 9.81 * np.column_stack([0 * t, -np.cos(angle), np.sin(angle)])
    gyr = scale * np.column_stack([rate, 0 * t, 0 * t])
    noise = rng.standard_normal((2, len(t), 3)) * [[[0.02]], [[2e-3 * scale]]]
    block = Block.of(t, acc + noise[0], gyr + noise[1])
    assert rate_unit_from_turn(split_by_time(block, 0.1), 9.81, 60.0) == unit
    assert rate_unit_from_turn(split_by_time(block[:300], 0.1), 9.81, 2.0) is None


@pytest.fixture
def devices(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """Ports that are plugged in; a z-up unit on the first."""
    sim = ["--serial", "witmotion", "--speed", "10", "--mounting=+x,-z,+y"]
    with ExitStack() as stack:
        device = VirtualMover(sim, once=False)
        stack.callback(device.close)
        there = [device.port]
        named = lambda: [{"port": p, "what": "", "serial": ""} for p in there]  # noqa: E731
        monkeypatch.setattr(ports, "serial_ports", named)
        yield there


def options(**given: object) -> Namespace:
    known: dict[str, object] = {
        "device": None, "headless": True, "mounting": None, "gravity": None,
    }  # fmt: skip
    return Namespace(**(known | given))


def test_the_one_that_answers_is_taken_and_said(
    devices: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    args = options()
    find_device(args)
    assert args.device.startswith(f"serial:{devices[0]}?format=witmotion&baud=")
    assert args.mounting == "+x,-z,+y"
    said = capsys.readouterr().err
    assert "+z is up" in said and "witmotion at" in said
    assert f'the next time: --device "{args.device}" --mounting=+x,-z,+y' in said


def test_only_a_clear_answer_to_the_question_takes_a_device(
    devices: list[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Enter in the seconds before, by somebody impatient, is none; nor is a typo."""
    pytest.importorskip("termios")
    hand, terminal_file = os.openpty()
    asked = []

    def answer(text: str, end: str = "\n") -> None:
        if not end:
            asked.append(text)
            os.write(hand, answers.pop(0))

    monkeypatch.setattr("fieldcal.commands.find_device._print_line", answer)
    monkeypatch.setattr("fieldcal.commands.find_device.LISTEN_S", 0.2)
    with os.fdopen(terminal_file) as file:
        monkeypatch.setattr(sys, "stdin", file)
        for answers, takes in (
            ([b"what\n", b"\x1b[A\n", b"\n"], True),
            ([b"Yes\n"], True),
            ([b"w\n", b"n\n"], False),
            ([b"q\n"], False),
            ([b"\x04"], False),  # Ctrl-D
        ):
            asked.clear()
            many, args = len(answers), options(headless=False)
            os.write(hand, b"\n\n")
            with nullcontext() if takes else pytest.raises(Stopped):
                find_device(args)
            assert len(asked) == many and bool(args.device) == takes
    os.close(hand)


def test_two_on_one_port_are_refused_before_anything_is_recorded(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rng = np.random.default_rng(6)
    rows = np.array([0.1, -0.2, 9.8, 0.01, -0.02, 0.005])
    rows = rows + np.repeat([0.02, 1e-3], 3) * rng.standard_normal((1000, 6))
    rows[1::2] += [0.4, 0.3, -0.2, 0.02, -0.01, 0.01]
    line = b"%.4f,%.4f,%.4f,%.5f,%.5f,%.5f\n"
    with talking(lambda i: line % tuple(rows[i % 1000])) as port:
        there = [{"port": port, "what": "", "serial": ""}]
        monkeypatch.setattr(ports, "serial_ports", lambda: there)
        with pytest.raises(InputError, match=r"two devices seem.*give each a port"):
            find_device(options())


def test_none_and_too_many_are_questions(
    devices: list[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr("fieldcal.commands.find_device.LISTEN_S", 0.3)
    devices.append("/dev/nowhere")
    find_device(options())
    said = capsys.readouterr().err
    assert "not taken: /dev/nowhere: cannot open /dev/nowhere: there is no" in said
    devices[1] = devices[0]
    with pytest.raises(InputError, match='2 devices answer, say which: --device "ser'):
        find_device(options())
    devices[:] = ["/dev/nowhere"]
    with pytest.raises(InputError, match="no device answers ./dev/nowhere: "):
        find_device(options())
    devices.clear()
    with pytest.raises(InputError, match="no serial port is plugged in: plug"):
        find_device(options())


PLAN = """
[run]
procedure = "two_position"
seconds = 2
"""


@pytest.mark.parametrize("mounting", ["", '\n[frame]\nmounting = ["+x", "+y", "+z"]\n'])
def test_a_plan_without_a_device_finds_it_as_a_procedure_does(
    devices: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    mounting: str,
) -> None:
    """What `fieldcal plan` writes names no device; its mounting is not overruled."""
    ran: list[PlanTask] = []

    def carry_out(_: object, __: Namespace, task: PlanTask, ___: Path) -> int:
        ran.append(task)
        return 0

    monkeypatch.setattr(run, "_run_and_show", carry_out)
    plan = tmp_path / "plan.toml"
    plan.write_text(PLAN + mounting)
    assert main(["run", str(plan), "--headless"]) == 0
    (task,) = ran
    assert str(task.run["device"]).startswith(f"serial:{devices[0]}?format=witmotion")
    assert task.about.axes == (("+x", "+y", "+z") if mounting else ("+x", "-z", "+y"))


def test_a_wrong_plan_is_refused_before_a_port_is_listened_to(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(ports, "serial_ports", lambda: pytest.fail("listened"))
    plan = tmp_path / "plan.toml"
    plan.write_text(PLAN.replace("= 2", "= 0"))
    assert main(["run", str(plan)]) == 2
    assert "[run] seconds" in capsys.readouterr().err
