"""MAVLink against a plain loop of recv_match, and a million spoilt frames."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

import numpy as np

from benchmarks._load import load_at_1_khz
from benchmarks.fuzz import BATCH, FRAMES, spoil
from fieldcal.core.samples import Block
from fieldcal.drivers.driver import open_driver
from fieldcal.drivers.mavlink_samples import MESSAGE_KINDS, MavlinkDecoder
from fieldcal.drivers.options import Options
from fieldcal.sim_device.mavlink_packing import messages

SAMPLES = 30_000
RUNS = 7
GOAL = 3.0
"""What decoding of our own must gain over the library's; without it 1 would do."""

SENDER = """
import socket, sys
first, rest = (open(name, "rb").read() for name in sys.argv[1:3])
server = socket.create_server(("127.0.0.1", 0))
print(server.getsockname()[1], flush=True)
while True:
    call, _ = server.accept()
    try:
        call.sendall(first + rest)
        call.shutdown(socket.SHUT_WR)
        while call.recv(4096):
            pass
    except OSError:
        pass
    call.close()
"""


def packets(name: str, count: int = SAMPLES) -> tuple[bytes, list[bytes]]:
    """Return a heartbeat, and the packet of each sample."""
    from pymavlink.dialects.v20 import all as dialect

    rng = np.random.default_rng(1)
    sent = Block.of(
        np.arange(1, count + 1) / 1000,
        rng.normal([0, 0, -9.8], 0.1, (count, 3)),
        rng.normal(0, 0.1, (count, 3)),
        np.full(count, 25.0),
    )
    out = dialect.MAVLink(None, 1, 1)
    packed = []
    for message in messages(dialect, MESSAGE_KINDS[name].identifier, sent):
        packed.append(message.pack(out))
        out.seq = (out.seq + 1) % 256
    # a program that is not known is asked for no parameters
    return dialect.MAVLink_heartbeat_message(2, 0, 0, 0, 4, 3).pack(out), packed


def stream(name: str, count: int = SAMPLES) -> tuple[bytes, bytes]:
    """Return a heartbeat, and packets of the samples, one after the other."""
    heartbeat, packed = packets(name, count)
    return heartbeat, b"".join(packed)


@contextmanager
def sender(parts: tuple[bytes, bytes]) -> Iterator[int]:
    """Another process that sends them to whoever calls; yields its port."""
    with TemporaryDirectory() as folder:
        files = [Path(folder, name) for name in ("first", "rest")]
        for file, part in zip(files, parts, strict=True):
            file.write_bytes(part)
        command = [sys.executable, "-c", SENDER, *map(str, files)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            if process.stdout is None:
                raise AssertionError
            yield int(process.stdout.readline())
            process.terminate()


def plain(port: int, name: str) -> float:
    """Seconds of the processor until recv_match has returned all samples."""
    from pymavlink import mavutil

    began, got = process_time(), 0
    link: Any = mavutil.mavlink_connection(f"tcp:127.0.0.1:{port}")
    while got < SAMPLES:
        message = link.recv_match(type=name, blocking=True)
        if message.xacc is not None:
            got += 1
    took = process_time() - began
    link.close()
    return took


def driven(port: int, name: str) -> float:
    """Seconds of the processor until the driver has delivered all samples."""
    began, got = process_time(), 0
    url = f"mavlink:tcp:127.0.0.1:{port}?message={name}&rate=0&reconnect=0"
    with open_driver(url) as imu:
        for block in imu.blocks():
            got += len(block)
            if got >= SAMPLES:
                return process_time() - began
    raise AssertionError


def spoilt(name: str) -> tuple[int, int, int]:
    """Frames that came through a million, wrong samples, most bytes kept."""
    rng = np.random.default_rng(99)
    unit = "mg" if MESSAGE_KINDS[name].whole else "m/s^2"
    query = f"message={name}&acc_unit={unit}"
    _, sent = stream(name, BATCH)
    whole = MavlinkDecoder(Options("fuzz", query)).feed(sent, 0.0)
    if whole is None:
        raise AssertionError
    known = {row.tobytes() for row in whole.six}
    through = wrong = kept = 0
    for _ in range(FRAMES // BATCH):
        decoder = MavlinkDecoder(Options("fuzz", query))
        got = decoder.feed(spoil(sent, rng), 0.0)
        kept = max(kept, decoder.waiting_bytes)
        if got is not None:
            through += len(got)
            wrong += sum(row.tobytes() not in known for row in got.six)
    return through, wrong, kept


def main() -> None:
    """Print throughput of both, their ratio, the load at 1 kHz, and what fuzz does."""
    print(f"{'message':12} {'recv_match':>12} {'driver':>12}  ratio  goal  at 1 kHz")
    for name in ("RAW_IMU", "HIGHRES_IMU"):
        with sender(stream(name)) as port:
            # in turn: other load on the machine meets both
            pairs = [(plain(port, name), driven(port, name)) for _ in range(RUNS)]
        loop, ours = (median(column) for column in zip(*pairs, strict=True))
        ratio = median(a / b for a, b in pairs)
        url = f"mavlink:{{}}?message={name}&rate=1000"
        share = load_at_1_khz(["--mavlink", "tcpin:127.0.0.1:0"], url).share
        print(
            f"{name:12} {SAMPLES / loop / 1e3:8.0f} k/s {SAMPLES / ours / 1e3:8.0f} k/s"
            f"  {ratio:5.1f}  {GOAL:4.1f}  {100 * share:4.1f} % of a core"
        )
    for name in ("RAW_IMU", "HIGHRES_IMU"):
        through, wrong, kept = spoilt(name)
        print(
            f"{name}: of {FRAMES} frames, most of them spoilt, {through} came through,"
            f" {wrong} of them wrong (odds of the check: {FRAMES * 2**-16:.0f}),"
            f" at most {kept} bytes waited"
        )
