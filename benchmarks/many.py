"""How many devices at 1 kHz one core carries without a loss, in real time.

One process on one core hears and decodes N devices at once, each with a driver of its
own; another process, on the other cores, sends what they say, a batch every 10 ms. N is
raised until samples are lost or the core has nothing left.
"""

import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic, perf_counter, process_time, sleep

from benchmarks.codecs import TOLD, stream
from fieldcal.driver import Driver, open_driver
from fieldcal.errors import DeviceError

RATE, SECONDS = 1000, 5.0
FORMATS = ("witmotion", "vectornav", "xsens", "vnimu")
LOOK = 0.02
"""Time between two looks at all devices, s."""

COUNTS = (25, 50, 100, 150, 200)

SENDER = """
import os, sys, time, tty
data, size, count, rate, seconds = open(sys.argv[1], "rb").read(), *map(
    float, sys.argv[2:6])
size, count = int(size), int(count)
ends = [os.openpty() for _ in range(count)]
for ours, theirs in ends:
    tty.setraw(theirs)
    os.set_blocking(ours, False)
    print(os.ttyname(theirs), flush=True)
sys.stdin.readline()
began, sent, refused = time.monotonic(), 0, 0
while sent < rate * seconds:
    time.sleep(0.01)
    due = int(min(rate * seconds, (time.monotonic() - began) * rate))
    batch = data[sent * size : due * size]
    for ours, _ in ends:
        try:
            refused += os.write(ours, batch) < len(batch)
        except BlockingIOError:
            refused += 1
    sent = due
print(sent, refused, flush=True)
sys.stdin.readline()
"""


def carried(name: str, count: int) -> tuple[int, int, float]:
    """Samples sent to each, the most that one of the drivers lost, share of a core."""
    samples = int(RATE * SECONDS)
    data, cores = stream(name, samples), sorted(os.sched_getaffinity(0))
    size = len(data) // samples
    with TemporaryDirectory() as folder:
        file = Path(folder, "stream")
        file.write_bytes(data)
        numbers = map(str, (size, count, RATE, SECONDS))
        with subprocess.Popen(
            [sys.executable, "-c", SENDER, str(file), *numbers],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        ) as sender:
            told, orders = sender.stdout, sender.stdin
            if told is None or orders is None:
                raise AssertionError
            ports = [told.readline().strip() for _ in range(count)]
            os.sched_setaffinity(0, cores[:1])
            query = f"{TOLD.get(name, '')}format={name}"
            drivers = [open_driver(f"serial:{port}?{query}") for port in ports]
            orders.write("\n")
            orders.flush()
            got, share = heard(drivers)
            sent = int(told.readline().split()[0])
            for driver in drivers:
                driver.close()
            orders.write("\n")
            orders.close()
    os.sched_setaffinity(0, cores)
    return sent, sent - min(got), share


def heard(drivers: list[Driver]) -> tuple[list[int], float]:
    """Samples that each got, and the share of a core that all took."""
    got = [0] * len(drivers)
    began, spent, until = perf_counter(), process_time(), monotonic() + SECONDS + 2.0
    busy = SECONDS
    while monotonic() < until and min(got) < RATE * SECONDS:
        sleep(LOOK)
        for i, driver in enumerate(drivers):
            try:
                block = driver.receive(0.0)
            except DeviceError:
                continue
            got[i] += 0 if block is None else len(block)
        busy = perf_counter() - began
    return got, (process_time() - spent) / busy


def main() -> None:
    """Print, for each format, how many devices were carried, and what that took."""
    print(f"{'format':10} {'devices':>7} {'sent':>6} {'lost':>5}  of a core")
    for name in FORMATS:
        for count in COUNTS:
            sent, lost, share = carried(name, count)
            print(f"{name:10} {count:7} {sent:6} {lost:5}  {100 * share:6.0f} %")
            if lost:
                break
