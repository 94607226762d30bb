"""The CAN driver on real links and logs, most with the virtual device behind them."""

from __future__ import annotations

import errno
import io
import json
import os
import re
import subprocess
import sys
import threading
import tty
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import can
import numpy as np
import pytest
from can_wires import until_the_end
from processes import FIELDCAL, SIM

from fieldcal.cli import main
from fieldcal.core.errors import DeviceError, DeviceSilent
from fieldcal.core.samples import Block, concat
from fieldcal.drivers.can_bus import BusSource, bus_error_text
from fieldcal.drivers.can_frame_groups import CanLinkHealth
from fieldcal.drivers.can_imu import CanImu
from fieldcal.drivers.driver import Driver, open_driver
from fieldcal.procedures import two_position
from fieldcal.run import movers
from fieldcal.run.engine import Engine
from fieldcal.run.operator.script import ScriptOperator
from fieldcal.session import description_file
from fieldcal.session.recorder import Recorder
from fieldcal.sim_device import Profile, VirtualDevice
from fieldcal.sim_device.line_faults import LineFaults
from fieldcal.sim_device.link_can import BusLink
from fieldcal.sim_device.profile import Sampling
from fieldcal.sim_device.remote import RemoteDevice
from fieldcal.sim_device.vocabulary import checked_effect

SLCAN = "interface=slcan&bitrate=500000&dbc=virtual"


@pytest.fixture
def sims() -> Iterator[list[subprocess.Popen[str]]]:
    started: list[subprocess.Popen[str]] = []
    yield started
    for sim in started:
        sim.terminate()
        sim.communicate()


def start(
    sims: list[subprocess.Popen[str]], *options: str, before: tuple[str, ...] = ()
) -> tuple[str, str]:
    """A virtual device in another process: its port or channel, and its control."""
    sims.append(
        subprocess.Popen(
            [*before, *SIM, *options],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
    )
    out = sims[-1].stdout
    assert out is not None
    return out.readline().strip(), out.readline().strip()


def some(imu: Driver, n: int) -> Block:
    """At least n samples."""
    got: list[Block] = []
    for block in imu.blocks(5.0):
        got.append(block)
        if sum(map(len, got)) >= n:
            break
    return concat(got)


LSB = np.array([1e-4] * 3 + [np.deg2rad(0.004)] * 3)


def test_slcan_between_two_processes_loses_nothing_of_a_minute_at_1_khz(
    sims: list[subprocess.Popen[str]],
) -> None:
    port, _ = start(
        sims,
        *("--can", "slcan", "--rate", "1000", "--speed", "max", "--once"),
        *("--duration", "60", "--seed", "4"),
    )
    with open_driver(f"can:{port}?{SLCAN}&reconnect=0") as imu:
        block = until_the_end(imu)
        health = imu.health
    assert isinstance(health, CanLinkHealth)
    assert len(block) == health.samples == 60_000
    assert health.bad == health.gaps == health.incomplete == health.repeated == 0
    np.testing.assert_allclose(block.t, np.arange(60_000) / 1000, atol=1e-6)
    np.testing.assert_array_equal(block.seq, np.arange(60_000) % 16)
    earth = checked_effect("earth_rate", {})
    profile = Profile(sampling=Sampling(1000.0), effects=(earth,))
    truth = VirtualDevice(profile, seed=4).take(60_000)
    off = np.abs(block.six - truth.six) / LSB
    assert off.max() < 0.5 + 1e-6
    assert np.abs(block.temperature - truth.temperature).max() < 0.005 + 1e-9


def test_a_calibration_over_can_finds_the_truth_within_its_uncertainty(
    tmp_path: Path,
) -> None:
    angles = [p.degrees or (0.0, 0.0) for p in two_position.POSITIONS]
    where = [{"alpha_deg": alpha, "beta_deg": beta} for alpha, beta in angles]
    site = {"latitude_deg": 50.45, "height_m": 170.0}
    about = description_file.parse_description({"site": site, "position": where})
    options = ["--can", "slcan", "--speed", "max", "--latitude=50.45", "--height=170"]
    with (
        movers.VirtualMover(options) as device,
        open_driver(f"can:{device.port}?{SLCAN}&reconnect=0") as imu,
        Recorder(tmp_path / "s", {"format": 1}) as recorder,
    ):
        operator = ScriptOperator(device, io.StringIO())
        engine = Engine(imu, operator, about, recorder, 90.0)
        found = engine.run(two_position.plan(about, 20.0, None)).to_json()
        truth = device.truth
    for group in ("acc_bias", "acc_scale", "gyr_bias"):
        result = found["parameters"][group]
        pull = np.subtract(result["value"], truth[group]) / np.array(result["sigma"])
        assert np.abs(pull).max() < 4.5, group


def test_faults_of_the_line_cost_samples_and_make_none_up(
    sims: list[subprocess.Popen[str]],
) -> None:
    port, control = start(sims, "--can", "slcan", "--speed", "max")
    twin = VirtualDevice(Profile(), seed=1).take(20_000)
    with RemoteDevice(control) as remote, open_driver(f"can:{port}?{SLCAN}") as imu:
        got = [some(imu, 500)]
        for fault in ({"lose_bytes": 5}, {"double_bytes": 5}, {"garbage_bytes": 99}):
            remote.ask(fault=fault)
            got.append(some(imu, 500))
        health = imu.health
    assert isinstance(health, CanLinkHealth)
    block = concat(got)
    at = np.rint(block.t * 100).astype(int)
    assert np.abs(block.acc - twin.acc[at]).max() < 1e-4
    assert 0 < health.bad < 30 and 0 < health.incomplete < 30
    assert health.missing >= health.incomplete - 2


def test_hang_up_and_return_is_a_gap(
    sims: list[subprocess.Popen[str]], tmp_path: Path
) -> None:
    link = tmp_path / "adapter"
    _, control = start(
        sims, "--can", "slcan", "--port-link", str(link), "--speed", "20"
    )
    with RemoteDevice(control) as remote, open_driver(f"can:{link}?{SLCAN}") as imu:
        before = some(imu, 50)
        remote.ask(fault={"hangup_s": 4})
        after = some(imu, 500)
        assert imu.health.gaps == 1 and imu.health.missing > 300
        t = np.concatenate([before.t, after.t])
        assert (np.diff(t) > 0).all() and np.diff(t).max() > 3.9


HOST = """
import sys
from fieldcal.drivers.driver import open_driver
with open_driver("can:239.74.163.2?interface=udp_multicast&dbc=virtual") as imu:
    print("listening", flush=True)
    got = 0
    for block in imu.blocks(10.0):
        got += len(block)
        if got >= 300:
            break
    h = imu.health
    print(got, h.gaps, h.incomplete, h.bad, *block.acc[-1])
"""


def test_udp_multicast_between_two_processes(
    sims: list[subprocess.Popen[str]], namespace: tuple[str, ...]
) -> None:
    host = subprocess.Popen(
        [*namespace, sys.executable, "-c", HOST], stdout=subprocess.PIPE, text=True
    )
    assert host.stdout is not None and host.stdout.readline() == "listening\n"
    spec = "udp_multicast:239.74.163.2"
    address, _ = start(sims, "--can", spec, "--speed", "10", before=namespace)
    assert address == "239.74.163.2"
    got, gaps, incomplete, bad, *acc = host.communicate()[0].split()
    assert int(got) >= 300 and [gaps, incomplete, bad] == ["0", "0", "0"]
    assert abs(np.linalg.norm([float(a) for a in acc]) - 9.81) < 0.8


@pytest.fixture
def bus() -> Iterator[tuple[BusLink, Driver]]:
    """The virtual device and the driver on a bus within this process."""
    channel = f"test {os.getpid()}"
    with (
        closing(BusLink("virtual", channel, LineFaults(1))) as link,
        open_driver(f"can:{channel}?interface=virtual&dbc=virtual") as imu,
    ):
        yield link, imu


def pumped(link: BusLink, block: Block) -> None:
    link.send(block)
    while link.pending:
        link.pump()


def test_a_bus_within_the_process(bus: tuple[BusLink, Driver]) -> None:
    link, imu = bus
    device = VirtualDevice(Profile(), seed=2)
    truth = device.take(500)
    pumped(link, truth)
    block = some(imu, 500)
    assert np.abs(block.six - truth.six).max() < 1e-4
    link.hang_up()
    assert not link.attached()
    device.take(100)
    link.come_back()
    pumped(link, device.take(10))
    assert some(imu, 10).t[0] == pytest.approx(6.0)
    assert (imu.health.gaps, imu.health.missing) == (1, 100)


def test_a_bus_that_is_gone_is_said_by_the_device_and_mended_by_the_driver(
    bus: tuple[BusLink, Driver],
) -> None:
    link, imu = bus
    assert isinstance(imu, CanImu) and imu._reader is not None
    device = VirtualDevice(Profile(), seed=2)
    pumped(link, device.take(30))
    some(imu, 30)
    broken = imu._reader._source
    assert isinstance(broken, BusSource)
    broken._bus.shutdown()
    while imu._reader._source is broken:
        assert imu.receive(0.05) is None
    device.take(10)
    pumped(link, device.take(10))
    assert some(imu, 10).t[0] == pytest.approx(0.4)
    assert (imu.health.gaps, imu.health.missing) == (1, 10)
    assert link._bus is not None
    link._bus.shutdown()
    with pytest.raises(DeviceError, match="takes no frame"):
        pumped(link, device.take(1))


def test_faults_of_a_bus_are_lost_doubled_and_foreign_frames(
    bus: tuple[BusLink, Driver],
) -> None:
    link, imu = bus
    device = VirtualDevice(Profile(), seed=2)
    health = imu.health
    assert isinstance(health, CanLinkHealth)
    link._faults.order({"flip_bits": 3})
    pumped(link, device.take(400))
    block = some(imu, 397)
    assert len(block) == 397 and health.incomplete == 3
    link._faults.order({"double_bytes": 9, "garbage_bytes": 20})
    pumped(link, device.take(400))
    assert len(some(imu, 400)) == 400
    assert (health.strange, health.incomplete) == (20, 3)


def test_the_right_frames_are_missing(bus: tuple[BusLink, Driver]) -> None:
    link, imu = bus
    with pytest.raises(DeviceSilent, match="not a frame came; check wiring, power"):
        next(imu.blocks(0.05))
    with can.Bus(link.address, interface="virtual") as other:
        other.send(
            can.Message(arbitration_id=0x100, data=bytes(8), is_extended_id=False)
        )
        other.send(
            can.Message(arbitration_id=0x777, data=bytes(8), is_extended_id=False)
        )
        other.send(can.Message(arbitration_id=0x5, is_remote_frame=True))
        says = r"no AngularRate \(0x101\), Status \(0x102\); heard: 0x777; check dbc"
        with pytest.raises(DeviceSilent, match=says):
            next(imu.blocks(0.2))


def test_an_adapter_that_is_busy() -> None:
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    url = f"can:{os.ttyname(theirs)}?{SLCAN}"
    with open_driver(url):
        with pytest.raises(DeviceError, match="another program has it open"):
            open_driver(url)
    os.close(ours)
    os.close(theirs)


def test_only_error_frames(bus: tuple[BusLink, Driver]) -> None:
    link, imu = bus
    with can.Bus(link.address, interface="virtual") as other:
        other.send(can.Message(arbitration_id=4, is_error_frame=True))
        with pytest.raises(
            DeviceSilent, match="only error frames come; check bit rate"
        ):
            next(imu.blocks(0.2))


def test_an_adapter_at_the_wrong_baud_rate() -> None:
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    with open_driver(f"can:{os.ttyname(theirs)}?{SLCAN}") as imu:
        said: list[str] = []
        # on a busy machine what was written may not have been heard so soon
        while len(said) < 20 and not any("no frames" in text for text in said):
            os.write(ours, b"\x80\xff\x13\r" * 50)
            with pytest.raises(DeviceSilent) as caught:
                next(imu.blocks(0.3))
            said.append(str(caught.value))
        assert "no frames; check tty_baudrate" in said[-1]
    os.close(ours)
    os.close(theirs)


def test_a_kernel_without_can_and_channels_that_are_not_there(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    command = ["run", "two_position", "--headless", "-o", str(tmp_path / "s")]
    for url, says in (
        ("can:nosuch0?dbc=virtual", "no CAN; load it|no such CAN channel"),
        (f"can:{tmp_path}/tty?interface=slcan&dbc=virtual", "no such port"),
    ):
        assert main([*command, "--device", url]) == 3
        end = json.loads(capsys.readouterr().err.splitlines()[-1])
        assert end["exit_code"] == 3 and re.search(says, end["error"])
    for number, says in (
        (97, "the kernel has no CAN"),
        (19, "no such CAN channel"),
        (100, "is down"),
    ):
        assert says in bus_error_text(
            "socketcan", OSError(number, "what the kernel says")
        )


def test_a_network_without_multicast(
    namespace: tuple[str, ...], tmp_path: Path
) -> None:
    subprocess.run([*namespace, *"ip route del 224.0.0.0/4".split()], check=True)
    url = "can:239.74.163.2?interface=udp_multicast&dbc=virtual"
    for arguments, says in (
        (["run", "two_position", "--device", url, "-o", "s"], "add a route"),
        (["sim", "--can", "udp_multicast:239.74.163.2"], "cannot join"),
    ):
        done = subprocess.run(
            [*namespace, *FIELDCAL, *arguments],
            capture_output=True,
            text=True,
            check=False,
            cwd=tmp_path,
        )
        assert done.returncode == 3 and says in done.stderr, done.stderr
        assert done.stderr.count("\n") == 1


def test_without_the_extra_one_sentence_tells_what_to_install(tmp_path: Path) -> None:
    script = (
        "import sys\nsys.modules['can'] = None\n"
        "from fieldcal.cli import main\nsys.exit(main(sys.argv[1:]))\n"
    )
    for arguments in (
        ["run", "two_position", "--device", "can:can0?dbc=virtual", "-o", "s"],
        ["sim", "--can", "virtual:x"],
    ):
        done = subprocess.run(
            [
                sys.executable,
                "-c",
                script,
                *arguments,
                *(["-o", str(tmp_path)] * (arguments[0] == "run")),
            ],
            capture_output=True,
            text=True,
            check=False,
            cwd=tmp_path,
        )
        assert done.returncode == 2, done.stderr
        assert "pip install 'fieldcal[can]'" in done.stderr
        assert done.stderr.count("\n") == 1


def test_nothing_is_left_behind(bus: tuple[BusLink, Driver]) -> None:
    _, imu = bus
    name = f"read {imu.name}"
    assert name in [thread.name for thread in threading.enumerate()]
    imu.close()
    imu.close()
    assert name not in [thread.name for thread in threading.enumerate()]
    with pytest.raises(DeviceError, match="was closed"):
        imu.receive(0.1)


class Down:
    """An interface that is down: the kernel opens it, and refuses to receive."""

    def fileno(self) -> int:
        raise NotImplementedError

    def recv(self, timeout: float) -> None:
        down = OSError(errno.ENETDOWN, "Network is down")
        raise can.CanOperationError("Error receiving") from down

    def shutdown(self) -> None:
        return


def test_an_interface_that_is_down_is_said_and_ends_a_run_without_an_operator(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(can, "Bus", lambda *channel, **told: Down())
    url = "can:can0?dbc=virtual&reconnect=0.3"
    run = ["run", "two_position", "--headless", "--patience=0.3", "--device", url]
    assert main([*run, "-o", str(tmp_path / "s")]) == 3
    said = capsys.readouterr().err
    assert "can0: it is down; `ip link set` it up with its bitrate" in said
