"""Each serial format against the bare read of the same pty, as ratios in one run.

The ratio is that of samples a second by the clock, each read followed by a run of the
driver, so that other load on the machine meets both. Beside it is the ratio of the time
that the processor spends in this process, in which waiting for the sender has no part.
"""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter, process_time
from typing import IO, NamedTuple

import numpy as np

from benchmarks._load import load_at_1_khz
from fieldcal.core.samples import Block
from fieldcal.drivers.codec import wire_formats
from fieldcal.drivers.driver import open_driver
from fieldcal.drivers.serial_imu import SerialPort
from fieldcal.sim_device.wire import open_wire

SAMPLES = 500_000
RUNS = 7
"""Runs of each, in turn; medians are shown, and the median of the ratios of pairs."""

GOALS = {"text": 0.1, "vnimu": 0.1}
BINARY = 0.3
SENDER = """
import os, sys, tty
data = open(sys.argv[1], "rb").read()
ours, theirs = os.openpty()
tty.setraw(theirs)
print(os.ttyname(theirs), flush=True)
for _ in sys.stdin:
    left = memoryview(data)
    while left:
        left = left[os.write(ours, left):]
"""


def stream(name: str, samples: int = SAMPLES) -> bytes:
    """Bytes of the samples, one after the other."""
    rng = np.random.default_rng(1)
    sent = Block.of(
        np.arange(samples) / 1000,
        rng.normal(0, 10, (samples, 3)),
        rng.normal(0, 1, (samples, 3)),
        rng.normal(25, 1, samples),
        np.arange(samples, dtype=float),
    )
    return open_wire(name).encode(sent)


@contextmanager
def sender(data: bytes) -> Iterator[tuple[str, IO[str]]]:
    """Another process that sends the bytes over a pty, once for each order."""
    with TemporaryDirectory() as folder:
        file = Path(folder, "stream")
        file.write_bytes(data)
        command = [sys.executable, "-c", SENDER, str(file)]
        with subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        ) as process:
            told, orders = process.stdout, process.stdin
            if told is None or orders is None:
                raise AssertionError
            yield told.readline().strip(), orders
            orders.close()


def go(orders: IO[str]) -> None:
    """Let the sender send."""
    orders.write("\n")
    orders.flush()


class Took(NamedTuple):
    """Time that something took: by the clock, and of the processor, s."""

    clock: float
    processor: float


class Watch:
    """Begins to measure when it is made."""

    def __init__(self) -> None:
        self._clock, self._processor = perf_counter(), process_time()

    def read(self) -> Took:
        """Return what has been taken since."""
        return Took(perf_counter() - self._clock, process_time() - self._processor)


def bare(path: str, orders: IO[str], size: int) -> Took:
    """Read so many bytes and drop them."""
    port = SerialPort(path, 115200)
    go(orders)
    watch, left = Watch(), size
    while left:
        left -= len(port.read())
    port.close()
    return watch.read()


def driven(url: str, orders: IO[str]) -> tuple[Took, int]:
    """Have all samples there; and how many are missing."""
    with open_driver(url) as imu:
        go(orders)
        watch, got = Watch(), 0
        last = 1 if "text" in url else 0  # a first line without a checksum is dropped
        for block in imu.blocks(3.0):
            got += len(block)
            if got >= SAMPLES - last:
                return watch.read(), SAMPLES - last - got
    raise AssertionError


def share(name: str) -> float:
    """Share of a processor that a device at 1 kHz takes, in real time."""
    url = f"serial:{{}}?{TOLD.get(name, '')}format={name}"
    taken = load_at_1_khz(["--serial", name, "--once"], url)
    if not 900 < taken.heard < 1100:
        print(f"! {name}: {taken.heard:.0f} samples a second instead of 1000")
    return taken.share


TOLD = {"vnimu": "rate=1000&"}
"""Options that a format needs."""


def main() -> None:
    """Print bare and decoded throughput, their ratio, and the load at 1 kHz."""
    print(
        f"{'format':10} {'bare':>9} {'driver':>9} {'':>10}  ratio  goal  processor"
        "  lost  at 1 kHz"
    )
    for name in wire_formats():
        data = stream(name)
        with sender(data) as (path, orders):
            url = f"serial:{path}?{TOLD.get(name, '')}format={name}"
            reads, runs = [], []
            for _ in range(RUNS):  # in turn: other load on the machine meets both
                reads.append(bare(path, orders, len(data)))
                runs.append(driven(url, orders))
        raw = median(read.clock for read in reads)
        took = median(run.clock for run, _ in runs)
        pairs = list(zip(reads, (run for run, _ in runs), strict=True))
        ratio = median(read.clock / run.clock for read, run in pairs)
        spent = median(read.processor / run.processor for read, run in pairs)
        lost = max(n for _, n in runs)
        goal, taken = GOALS.get(name, BINARY), share(name)
        size, rate = len(data) / 1e6, SAMPLES / took / 1e3
        print(
            f"{name:10} {size / raw:4.0f} MB/s {size / took:4.0f} MB/s {rate:6.0f} k/s"
            f"  {ratio:5.2f}  {goal:4.1f}  {spent:9.2f}  {lost:4d}"
            f"  {100 * taken:4.1f} % of a core"
        )
