"""The serial driver on real ptys: what it delivers, and what it says when it cannot."""

import os
import re
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from wires import wit_acc, wit_cycles, wit_gyr

from fieldcal.core.errors import DeviceError, DeviceSilent, InputError
from fieldcal.core.samples import Array, Block, concat
from fieldcal.drivers.driver import Driver, host_clock, open_driver
from fieldcal.drivers.reader import Chunk
from fieldcal.drivers.serial_imu import (
    RECENT_BYTES,
    SerialImu,
    last_chunks,
    port_error_text,
)

ACC, GYR, CYCLES = wit_acc(1), wit_gyr(1), wit_cycles(3000)


@pytest.fixture
def pty() -> Iterator[tuple[int, str]]:
    ours, theirs = os.openpty()
    path = os.ttyname(theirs)
    yield ours, path
    os.close(theirs)
    try:
        os.close(ours)
    except OSError:
        pass  # a test hung up


def read(imu: Driver, size: int) -> None:
    """Wait until the driver's thread has read so many bytes that nobody has taken."""
    assert isinstance(imu, SerialImu)
    while imu._reader._held < size:
        time.sleep(0.001)


def collect(imu: Driver, n: int) -> Array:
    """First accelerations in counts, of the next n samples."""
    parts: list[Block] = []
    for block in imu.blocks(60.0):
        parts.append(block)
        if sum(len(part) for part in parts) >= n:
            break
    return np.round(concat(parts).acc[:, 0] / (16 * 9.80665 / 32768))


def test_samples_in_any_pieces(pty: tuple[int, str]) -> None:
    ours, path = pty
    stream = b"".join(CYCLES[:200])
    with open_driver(f"serial:{path}?format=witmotion&baud=115200") as imu:
        before = host_clock()
        for i in range(0, len(stream), 37):
            os.write(ours, stream[i : i + 37])
        got = collect(imu, 200)
        assert got.tolist() == list(range(200))
        assert imu.health.samples == 200
        os.write(ours, CYCLES[200])
        block = next(imu.blocks())
        assert before < block.t_host[0] < host_clock()


SENDER = """
import os, sys, tty
sys.path.insert(0, {root!r})
from wires import wit_cycles
ours, theirs = os.openpty()
tty.setraw(theirs)
print(os.ttyname(theirs), flush=True)
sys.stdin.readline()
for cycle in wit_cycles(3000):
    os.write(ours, cycle)
sys.stdin.readline()
"""


def test_nothing_is_lost_between_two_processes_and_a_hang_up_is_said() -> None:
    root = str(Path(__file__).parents[1])
    command = [sys.executable, "-c", SENDER.format(root=root)]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as sender:
        assert sender.stdin and sender.stdout
        path = sender.stdout.readline().strip()
        with open_driver(f"serial:{path}?reconnect=0") as imu:
            sender.stdin.write("\n")
            sender.stdin.flush()
            # a recorder that is busy: nothing must get lost
            read(imu, len(CYCLES) * len(CYCLES[0]))
            assert collect(imu, len(CYCLES)).tolist() == list(range(len(CYCLES)))
            assert imu.health.bad == imu.health.skipped == imu.health.gaps == 0
            sender.stdin.write("\n")
            sender.stdin.flush()
            with pytest.raises(DeviceError, match="hung up: check cable") as raised:
                collect(imu, 1)
            assert raised.value.exit_code == 3


def test_what_came_before_a_hang_up_is_delivered(pty: tuple[int, str]) -> None:
    ours, path = pty
    with open_driver(f"serial:{path}?reconnect=0") as imu:
        os.write(ours, b"".join(CYCLES[:50]) + ACC[:5])
        read(imu, 50 * len(CYCLES[0]) + len(ACC[:5]))
        os.close(ours)
        assert len(collect(imu, 50)) == 50
        with pytest.raises(DeviceError, match="hung up"):
            collect(imu, 1)


def test_a_port_behind_a_network_to_its_last_byte() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        place = f"socket://127.0.0.1:{server.getsockname()[1]}"
        with open_driver(f"serial:{place}?format=witmotion&reconnect=0") as imu:
            call, _ = server.accept()
            with call:
                call.sendall(b"".join(CYCLES) + ACC[:5])
            assert collect(imu, len(CYCLES)).tolist() == list(range(len(CYCLES)))
            assert imu.health.skipped == imu.health.gaps == 0
            with pytest.raises(DeviceError, match=f"{place} hung up: check cable"):
                collect(imu, 1)
    with pytest.raises(DeviceError, match="Connection refused; check host and port"):
        open_driver(f"serial:{place}")


def test_unplugged_and_back_resumes_with_a_gap(tmp_path: Path) -> None:
    link = tmp_path / "imu"
    first, second = os.openpty(), os.openpty()
    link.symlink_to(os.ttyname(first[1]))
    with open_driver(f"serial:{link}?reconnect=600") as imu:
        os.write(first[0], b"".join(CYCLES[:50]) + CYCLES[50][:20])
        assert len(collect(imu, 50)) == 50
        link.unlink()
        os.close(first[0])
        os.close(first[1])
        while not imu.reconnecting:
            imu.receive(0.01)
        link.symlink_to(os.ttyname(second[1]))
        while imu.reconnecting:
            imu.receive(0.01)
        os.write(second[0], b"".join(CYCLES[80:120]))
        assert collect(imu, 40).tolist() == list(range(80, 120))
        assert (imu.health.gaps, imu.health.missing) == (1, 30)
    for fd in second:
        os.close(fd)


def test_a_link_that_stays_away_is_given_up(pty: tuple[int, str]) -> None:
    ours, path = pty
    with open_driver(f"serial:{path}?reconnect=0.3") as imu:
        os.close(ours)
        with pytest.raises(DeviceError, match=r"was not back in 0\.3 s: check cable"):
            next(imu.blocks(0.1))


def test_silence(pty: tuple[int, str]) -> None:
    with open_driver(f"serial:{pty[1]}") as imu:
        with pytest.raises(DeviceSilent, match="no sample for 0.1 s: not a byte"):
            next(imu.blocks(0.1))
        os.write(pty[0], ACC + GYR + CYCLES[0])
        assert len(next(imu.blocks(60.0))) == 1
        with pytest.raises(DeviceSilent, match="went silent for 0.1 s: not a byte"):
            next(imu.blocks(0.1))


@pytest.mark.parametrize(
    ("garbage", "says"),
    [
        (b"1.0,2.0,3.0\r\n" * 20, "lines of numbers come, such as '1.0,2.0,3.0'"),
        (os.urandom(300), "no format that is known; check the baud"),
    ],
)
def test_garbage(pty: tuple[int, str], garbage: bytes, says: str) -> None:
    with open_driver(f"serial:{pty[1]}") as imu:
        os.write(pty[0], garbage)
        read(imu, len(garbage))
        with pytest.raises(DeviceSilent, match=says):
            next(imu.blocks(0.2))


def test_of_a_flood_of_noise_little_is_kept() -> None:
    """As much as tells a format, whatever the size of the pieces."""
    for size in (1, 1000, 1 << 16):
        chunks = [Chunk(0.01 * i, bytes(size)) for i in range(20_000 // size + 40)]
        kept = last_chunks(chunks)
        assert kept == chunks[-len(kept) :]
        assert RECENT_BYTES <= sum(len(c.data) for c in kept) < RECENT_BYTES + size
    assert last_chunks(chunks[:0]) == []


def test_frames_without_a_sample(pty: tuple[int, str]) -> None:
    with open_driver(f"serial:{pty[1]}") as imu:
        os.write(pty[0], GYR * 20)
        read(imu, len(GYR) * 20)
        with pytest.raises(DeviceSilent, match="check what the device is to send"):
            next(imu.blocks(0.2))


def test_drain_takes_what_is_there_and_no_more(pty: tuple[int, str]) -> None:
    ours, path = pty
    with open_driver(f"serial:{path}") as imu:
        os.write(ours, b"".join(CYCLES[:30]))
        read(imu, 30 * len(CYCLES[0]))
        assert len(imu.drain()) == 30
        assert len(imu.drain()) == 0
        os.write(ours, CYCLES[30])
        assert collect(imu, 1).tolist() == [30]


def test_the_thread_ends_with_the_driver(pty: tuple[int, str]) -> None:
    before = threading.active_count()
    imu = open_driver(f"serial:{pty[1]}")
    assert threading.active_count() == before + 1
    imu.close()
    imu.close()
    assert threading.active_count() == before
    with pytest.raises(DeviceError, match="closed"):
        imu.receive(0.1)


def test_a_port_that_is_busy(pty: tuple[int, str]) -> None:
    with open_driver(f"serial:{pty[1]}"):
        with pytest.raises(DeviceError, match="another program has it open"):
            open_driver(f"serial:{pty[1]}")


def test_a_port_that_is_not_there_and_one_that_is_none(tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match="there is no such port") as raised:
        open_driver(f"serial:{tmp_path}/ttyUSB7")
    assert raised.value.exit_code == 3
    file = tmp_path / "log.txt"
    file.write_text("1,2,3")
    for path in (file, tmp_path):
        with pytest.raises(DeviceError, match="this is no serial port"):
            open_driver(f"serial:{path}")


def test_permission_denied(tmp_path: Path) -> None:
    port = tmp_path / "port"
    port.touch(mode=0o000)
    if os.access(port, os.R_OK):
        assert "dialout" in port_error_text(PermissionError(13, "Permission denied"))
        return
    with pytest.raises(DeviceError, match="no permission; add yourself"):
        open_driver(f"serial:{port}")


@pytest.mark.parametrize(
    "url",
    [
        "telepathy:me",
        "/dev/ttyUSB0",
        "serial:",
        "serial:x?baud=fast",
        "serial:x?format=morse",
        "serial:x?bauds=9600",
        "serial:x?baud",
        "serial:socket://127.0.0.1",
        "serial:socket://:4001",
    ],
)
def test_addresses_that_are_none(url: str) -> None:
    with pytest.raises(InputError) as raised:
        open_driver(url)
    assert not re.search(r"[\[{<]", str(raised.value).replace(url, ""))
