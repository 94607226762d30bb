"""A person at the keys, through a terminal."""

import io
import os
import pty
import re
import subprocess
import sys
from collections.abc import Iterator

import numpy as np
import pytest

from fieldcal.core.escaping import EscapingStream
from fieldcal.sim_device import VirtualDevice
from fieldcal.sim_device.keys import SteeringKeys
from fieldcal.sim_device.line_faults import LineFaults
from fieldcal.sim_device.link_serial import SerialLink
from fieldcal.sim_device.orders import carry_out
from fieldcal.sim_device.stream import DeviceStream
from fieldcal.sim_device.wire import open_wire

LEFT, RIGHT, UP, DOWN = b"\x1b[D", b"\x1b[C", b"\x1b[A", b"\x1b[B"


@pytest.fixture
def terminal() -> Iterator[tuple[int, int]]:
    """The person's side and the program's side."""
    person, program = pty.openpty()
    yield person, program
    os.close(person)
    os.close(program)


@pytest.fixture
def stream() -> Iterator[DeviceStream]:
    faults = LineFaults(1)
    link = SerialLink(open_wire("witmotion"), faults)
    yield DeviceStream(VirtualDevice(), link, faults, speed=np.inf)
    link.close()


def test_keys_turn_bump_and_quit(
    stream: DeviceStream, terminal: tuple[int, int]
) -> None:
    person, program = terminal
    screen = io.StringIO()
    device = stream.device
    with SteeringKeys(stream, (22.5, 2.5), program, screen) as keys:
        os.write(person, RIGHT + RIGHT + LEFT + UP + DOWN + DOWN + b"?b")
        keys.serve()
        np.testing.assert_allclose(np.rad2deg(device.angles), [22.5, -2.5, 0])
        assert device.busy_until == 24.0
        assert len(device.body.base_motions) == 1
        device.take(2500)
        os.write(person, b"h")
        keys.serve()
        assert device.angles == (0.0, 0.0, 0.0)
        keys.serve()
        os.write(person, b"q")
        keys.serve()
    stream.run()
    shown = screen.getvalue()
    assert "quit" in shown
    assert "turning to α = 22.5°, β = -2.5°   nobody listens" in shown
    assert "25.0 s   turning to α = 0°, β = 0°" in shown


def test_the_line_is_written_over_where_text_of_others_is_only_shown(
    stream: DeviceStream, terminal: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As the command runs: control characters of names are shown, not carried out."""
    screen = io.StringIO()
    monkeypatch.setattr("sys.stderr", EscapingStream(screen))
    with SteeringKeys(stream, (22.5, 2.5), terminal[1]) as keys:
        keys.serve()
    assert "\r     0.0 s   at α = 0°" in screen.getvalue()
    assert "\\x" not in screen.getvalue()


def test_a_terminal_that_is_closed_is_no_fault_of_the_device(
    stream: DeviceStream,
) -> None:
    """A window that is closed, or a broken connection, ends it by a signal."""
    person, program = pty.openpty()
    with pytest.raises(KeyboardInterrupt):
        with SteeringKeys(stream, (22.5, 2.5), program, io.StringIO()):
            os.close(person)
            raise KeyboardInterrupt
    os.close(program)


def test_orders_and_keys_do_the_same(stream: DeviceStream) -> None:
    carry_out(stream, {"bump": {"push": 1.5, "tilt_deg": 2.0, "seconds": 0.4}})
    bump, t = stream.device.body.base_motions[-1], np.linspace(0, 0.4, 4001)
    assert (bump.start, bump.end) == (0.0, 0.4) and bump.push is not None
    peak = np.linalg.norm(bump.push(t), axis=0).max()
    assert peak == pytest.approx(1.5, rel=1e-5)
    assert np.rad2deg(bump.angle(t).x).max() == pytest.approx(2.0)
    assert carry_out(stream, {"bump": {"at_s": 7.0}})["until_s"] == 7.5
    assert (stream.device.body.base_motions[-1].start, stream.device.time) == (7.0, 0.0)
    carry_out(stream, {"turn": {"alpha_deg": 10.0}})
    carry_out(stream, {"turn": {"beta_deg": 2.0}})
    np.testing.assert_allclose(np.rad2deg(stream.device.angles), [10, 2, 0])


def test_what_a_reader_left_is_not_for_the_next_one() -> None:
    device = VirtualDevice()
    link = SerialLink(open_wire("text?columns=seq"), LineFaults(1))
    port = os.open(link.port, os.O_RDWR | os.O_NOCTTY)
    while not link.pending:
        link.send(device.take(1000))
        link.pump()
    os.close(port)
    link.pump()
    assert not link.attached() and not link.pending
    port = os.open(link.port, os.O_RDWR | os.O_NOCTTY)
    device.take(1)
    first = int(device.time * device.rate)
    link.send(device.take(3))
    link.pump()
    assert os.read(port, 100).split() == [b"%d" % (first + k) for k in range(3)]
    os.close(port)
    link.close()
    link.close()


def test_the_terminal_is_as_before_when_it_ends(terminal: tuple[int, int]) -> None:
    import termios

    person, program = terminal
    before = termios.tcgetattr(program)
    sim = subprocess.Popen(
        [sys.executable, "-m", "fieldcal", "sim"],
        stdin=program,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert sim.stdout is not None and sim.stderr is not None
    assert sim.stdout.readline().startswith("/dev/")
    assert "quit" in sim.stderr.readline()
    os.write(person, UP + b"q")
    _, said = sim.communicate()
    assert sim.returncode == 0
    assert re.search("β = (2.5|0)°", said)
    assert termios.tcgetattr(program) == before
