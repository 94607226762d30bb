"""`fieldcal sim` in a process of its own, read through its pty, told by its socket."""

import json
import os
import select
import signal
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from processes import SIM

from fieldcal.core.errors import DeviceError, InputError
from fieldcal.core.samples import Array, concat
from fieldcal.sim_device import Profile, VirtualDevice
from fieldcal.sim_device.line_faults import LineFaults
from fieldcal.sim_device.link_serial import SerialLink
from fieldcal.sim_device.remote import RemoteDevice
from fieldcal.sim_device.vocabulary import checked_effect
from fieldcal.sim_device.wire import open_wire

LSB = np.array([16 * 9.80665 / 32768] * 3 + [np.deg2rad(2000) / 32768] * 3)
SAMPLE = 33


class Sim:
    """A running virtual device."""

    def __init__(self, *options: str) -> None:
        self.process = subprocess.Popen(
            [*SIM, *options],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout is not None
        self.port = self.process.stdout.readline().strip()
        self.control = self.process.stdout.readline().strip()

    def open(self) -> int:
        return os.open(self.port, os.O_RDWR | os.O_NOCTTY)

    def ended(self) -> tuple[int, str]:
        _, said = self.process.communicate()
        return self.process.returncode, said


@pytest.fixture
def sims() -> Iterator[list[Sim]]:
    started: list[Sim] = []
    yield started
    for sim in started:
        if sim.process.poll() is None:
            sim.process.terminate()
        sim.ended()


def start(sims: list[Sim], *options: str) -> Sim:
    sims.append(Sim(*options))
    return sims[-1]


def read(port: int, size: int) -> bytes:
    """Up to `size` bytes; fewer only if the device goes."""
    data = b""
    while len(data) < size:
        assert select.select([port], [], [], 10)[0], "the device fell silent"
        try:
            piece = os.read(port, size - len(data))
        except OSError:
            break
        if not piece:
            break
        data += piece
    return data


def words(data: bytes) -> tuple[Array, Array]:
    """Milliseconds and raw words of whole samples."""
    frames = np.frombuffer(data, np.uint8).reshape(-1, 3, 11)
    assert (frames[:, :, 0] == 0x55).all()
    assert (frames[:, :, 1] == [0x50, 0x51, 0x52]).all()
    assert (frames[:, :, :10].sum(axis=2, dtype=np.uint8) == frames[:, :, 10]).all()
    clock = frames[:, 0, 2:10].astype(int)
    ms = (clock[:, 6] + 256 * clock[:, 7]) + 1000 * clock[:, 5] + 60000 * clock[:, 4]
    payload = np.ascontiguousarray(frames[:, 1:, 2:8]).view("<i2").reshape(-1, 6)
    return ms, payload


@pytest.mark.parametrize(
    "speed", [pytest.param("5", marks=pytest.mark.thorough), "max"]
)
def test_the_samples_are_those_of_the_device_at_any_speed(
    sims: list[Sim], speed: str
) -> None:
    sim = start(
        sims, "--speed", speed, "--seed", "7", "--base-tilt=-1,0.5", "--duration", "6"
    )
    with RemoteDevice(sim.control) as remote:
        reply = remote.ask(turn={"alpha_deg": 30, "beta_deg": 5, "at_s": 1.0})
        assert reply == {"time_s": 0.0, "until_s": 5.0}
        port = sim.open()
        ms, got = words(read(port, 10**6))
        os.close(port)
    assert sim.ended() == (0, "")
    tilt = checked_effect("base_tilt", {"about_x_deg": -1, "about_z_deg": 0.5})
    twin = VirtualDevice(
        Profile().having(checked_effect("earth_rate", {}), tilt), seed=7
    )
    twin.turn(np.deg2rad(30.0), np.deg2rad(5.0), at=1.0)
    block = concat([twin.take(1) for _ in range(600)])
    np.testing.assert_array_equal(ms, np.arange(0, 6000, 10))
    np.testing.assert_array_equal(got, np.rint(block.six / LSB))


def test_a_real_device_does_not_wait_for_its_reader(sims: list[Sim]) -> None:
    sim = start(sims, "--rate", "200", "--seed", "3")
    with RemoteDevice(sim.control) as remote:
        while remote.ask(status=True)["time_s"] < 0.5:
            pass
        port = sim.open()
        ms, got = words(read(port, 20 * SAMPLE))
        os.close(port)
        assert ms[0] >= 500
        np.testing.assert_array_equal(np.diff(ms), 5)
        while remote.ask(status=True)["attached"]:
            pass
        later = remote.ask(status=True)["time_s"] + 0.3
        while remote.ask(status=True)["time_s"] < later:
            pass
        port = sim.open()
        ms, _ = words(read(port, 5 * SAMPLE))
        assert ms[0] >= 1000 * later - 5
        os.close(port)


def test_a_fast_device_waits_for_its_reader(sims: list[Sim]) -> None:
    sim = start(sims, "--speed", "max")
    with RemoteDevice(sim.control) as remote:
        assert remote.ask(status=True)["time_s"] == 0.0
        port = sim.open()
        ms, _ = words(read(port, 100 * SAMPLE))
        stopped: list[float] = []
        while len(stopped) < 3 or stopped[-1] != stopped[-3]:
            stopped.append(remote.ask(status=True)["time_s"])
            select.select([], [], [], 0.05)
        more, _ = words(read(port, 2000 * SAMPLE))
        np.testing.assert_array_equal(np.diff([*ms, *more]), 10)
        os.close(port)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_ends_it_and_nothing_is_left(
    sims: list[Sim], tmp_path: Path, number: signal.Signals
) -> None:
    link = tmp_path / "imu"
    sim = start(sims, "--port-link", str(link))
    assert sim.port == str(link)
    assert link.is_symlink() and Path(sim.control).is_socket()
    sim.process.send_signal(number)
    assert sim.ended() == (130, "")
    assert not link.is_symlink()
    assert not Path(sim.control).exists() and not Path(sim.control).parent.exists()


def test_it_can_be_told_to_stop(sims: list[Sim], tmp_path: Path) -> None:
    truth = tmp_path / "truth.json"
    sim = start(
        sims,
        *("--truth", str(truth), "--control", str(tmp_path / "orders")),
        *("--acc-bias=0.1,-0.2,0.3", "--with", "dropped:fraction=0.1"),
        *("--with", "earth_rate"),
    )
    assert sim.control == str(tmp_path / "orders")
    with RemoteDevice(sim.control) as remote:
        assert remote.ask(stop=True)["stopped"] is True
    assert sim.ended() == (0, "")
    assert not (tmp_path / "orders").exists()
    concealed = json.loads(truth.read_text())
    assert concealed["acc_bias"] == [0.1, -0.2, 0.3]
    assert concealed["effects"]["dropped"] == {"fraction": 0.1}


def test_silence_garbage_and_hanging_up(sims: list[Sim]) -> None:
    sim = start(sims, "--speed", "max")
    with RemoteDevice(sim.control) as remote:
        port = sim.open()
        read(port, 10 * SAMPLE)
        reply = remote.ask(fault={"silence_s": 2})
        until = reply["until_s"]
        assert until == pytest.approx(reply["time_s"] + 2)
        data = read(port, 2500 * SAMPLE)
        ms, _ = words(data)
        gaps = np.diff(ms)
        assert gaps.max() > 1800 and (gaps == 10).sum() == len(gaps) - 1
        assert abs(ms[np.argmax(gaps) + 1] / 1000 - until) < 0.51
        remote.ask(fault={"garbage_bytes": 100, "flip_bits": 1})
        with pytest.raises((AssertionError, ValueError)):
            words(read(port, 3000 * SAMPLE))
        remote.ask(fault={"hangup_s": 1.0})
        while read(port, 1000):
            pass
        os.close(port)
        assert sim.process.stdout is not None
        again = sim.process.stdout.readline().strip()
        port = os.open(again, os.O_RDWR | os.O_NOCTTY)
        words(read(port, 10 * SAMPLE))
        os.close(port)


def test_it_can_end_with_its_reader(sims: list[Sim], tmp_path: Path) -> None:
    link = tmp_path / "imu"
    sim = start(sims, "--once", "--speed", "50", "--port-link", str(link))
    port = sim.open()
    read(port, 5 * SAMPLE)
    os.close(port)
    assert sim.ended() == (0, "")
    assert not link.is_symlink()


def test_a_device_from_a_file_on_a_text_line(sims: list[Sim], tmp_path: Path) -> None:
    profile = tmp_path / "device.toml"
    profile.write_text(
        "[sampling]\nrate_hz = 50\n[truth]\nacc_bias = [0, 0, 1]\n"
        "[effects.quantisation]\nacc = 0.5\n"
    )
    sim = start(
        sims,
        *("--profile", str(profile), "--serial", "text?columns=seq,az&separator=tab"),
        *("--speed", "max", "--acc-noise=0,0,0", "--duration", "1", "--rate", "25"),
    )
    port = sim.open()
    lines = read(port, 10**6).decode().splitlines()
    os.close(port)
    assert lines == [f"{seq}\t1" for seq in range(25)]


def test_orders_that_are_none_are_refused_and_do_nothing(sims: list[Sim]) -> None:
    sim = start(sims)
    with RemoteDevice(sim.control) as remote:
        for order, says in (
            ({"dance": {}}, "one key of turn"),
            ({"turn": {"alpha": 3}}, "does not take 'alpha'"),
            ({"turn": {"alpha_deg": "up"}}, "must be a number"),
            ({"turn": 3}, "takes an object"),
            ({"turn": {"at_s": -1}}, "nothing can begin"),
            ({"spin": {}}, "three numbers"),
            ({"fault": {}}, "needs one of"),
            ({"fault": {"silence_s": -1}}, "0 or more"),
            ({"fault": {"flip_bits": 0}}, "whole number"),
            ({"bump": {"seconds": 0}}, "more than 0 s"),
            ({"bump": {"at_s": -1}}, "nothing can begin"),
            ({"turn": {}, "stop": True}, "one key"),
        ):
            with pytest.raises(InputError, match=says):
                remote.ask(**order)
        status = remote.ask(status=True)
        assert (status["alpha_deg"], status["moving"]) == (0.0, False)
        assert remote.turn(10, 2) >= 4.0
        assert remote.ask(spin={"rate_deg_s": [0, 10, 0]})["until_s"] >= 8.0
        assert remote.ask(bump={"push": 1.0})["until_s"] > 0
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as raw:
        raw.connect(sim.control)
        raw.sendall(b'not json\n[1]\n\n{"status": tr')
        replies = raw.makefile()
        assert "not JSON" in json.loads(replies.readline())["error"]
        assert "a request is like" in json.loads(replies.readline())["error"]
        raw.sendall(b"ue}\n")
        assert json.loads(replies.readline())["alpha_deg"] == pytest.approx(10)
        replies.close()


def test_a_second_device_does_not_take_a_name_that_is_taken(
    sims: list[Sim], tmp_path: Path
) -> None:
    path = tmp_path / "orders"
    first = start(sims, "--control", str(path))
    second = start(sims, "--control", str(path))
    code, said = second.ended()
    assert code == 2 and "another virtual device listens there" in said
    first.process.kill()
    first.process.wait()
    assert path.is_socket()
    third = start(sims, "--control", str(path))
    with RemoteDevice(third.control) as remote:
        remote.ask(stop=True)
    assert third.ended()[0] == 0
    with pytest.raises(DeviceError, match="no virtual device listens"):
        RemoteDevice(path)


def test_a_stale_link_is_replaced_and_a_file_is_not(
    sims: list[Sim], tmp_path: Path
) -> None:
    link = tmp_path / "imu"
    link.symlink_to("/dev/pts/none")
    sim = start(sims, "--port-link", str(link), "--duration", "0.2")
    assert sim.ended() == (0, "")
    link.write_text("precious")
    sim = start(sims, "--port-link", str(link))
    code, said = sim.ended()
    assert code == 2 and "is there already" in said
    assert link.read_text() == "precious"


def test_a_port_that_hung_up_has_no_name_until_it_is_back(tmp_path: Path) -> None:
    name = tmp_path / "imu"
    link = SerialLink(open_wire("witmotion"), LineFaults(1), name)
    link.hang_up()
    with pty_of_somebody_else() as stranger:
        assert stranger and not name.is_symlink()
        link.come_back()
        assert os.readlink(name) == link.port != stranger
    link.close()
    assert not name.is_symlink()


@contextmanager
def pty_of_somebody_else() -> Iterator[str]:
    ends = os.openpty()
    yield os.ttyname(ends[1])
    for end in ends:
        os.close(end)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--serial", "morse"], "no wire format"),
        (["--speed", "0"], "above 0, or max"),
        (["--duration", "0"], "above 0 s"),
        (["--base-tilt", "1"], "must be 2 numbers"),
        (["--acc-bias=a,b,c"], "must be 3 numbers"),
        (["--with", "voodoo:x=1"], "no effect is called 'voodoo'"),
        (["--with", "hum:ax=1"], "hum needs hz"),
        (["--profile", "/nowhere.toml"], "cannot be read"),
        (["--mounting", "+x,+y,-z"], "left-handed"),
        (["--rate", "-5"], "rate_hz = -5 must be above 0"),
        (
            ["--truth", "/nowhere/truth.json"],
            "the folder is not there: make it",
        ),
        (["--control", "/nowhere/socket"], "no control socket"),
        (["--base-tilt=1,1", "--with", "base_tilt:about_x_deg=1"], "given twice"),
    ],
)
def test_bad_input_is_one_sentence(
    options: list[str], says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    from fieldcal.cli import main

    assert main(["sim", *options]) == 2
    out, err = capsys.readouterr()
    assert out == "" and says in err and err.count("\n") == 1
