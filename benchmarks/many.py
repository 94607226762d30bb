"""How many devices at 1 kHz one core carries without a loss, in real time.

One process on one core hears and decodes N devices at once, each with a driver of its
own; another process, on the other cores, sends what they say, a batch every 10 ms. N is
raised until samples are lost or the core has nothing left. All are on ptys: serial
devices, adapters on a CAN bus (slcan), and autopilots.
"""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from itertools import accumulate
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic, perf_counter, process_time, sleep
from typing import NamedTuple

import numpy as np

from benchmarks import codecs, mavlink
from fieldcal.core.errors import DeviceError
from fieldcal.drivers.driver import Driver, open_driver
from fieldcal.sim_device import Profile, VirtualDevice
from fieldcal.sim_device.can_packing import frames

RATE, SECONDS = 1000, 5.0
SAMPLES = int(RATE * SECONDS)
FORMATS = ("witmotion", "vectornav", "xsens", "vnimu")
MESSAGE = "HIGHRES_IMU"
LOOK = 0.02
"""Time between two looks at all devices, s."""

COUNTS = (25, 50, 100, 150, 200)

SENDER = """
import os, sys, time, tty
folder, count, rate = sys.argv[1], int(sys.argv[2]), float(sys.argv[3])
greeting, data, ends = (
    open(f"{folder}/{name}", "rb").read() for name in ("greeting", "data", "ends"))
at = [0, *map(int, ends.split())]
ports = [os.openpty() for _ in range(count)]
for ours, theirs in ports:
    tty.setraw(theirs)
    os.set_blocking(ours, False)
    os.write(ours, greeting)
    print(os.ttyname(theirs), flush=True)
sys.stdin.readline()
began, sent = time.monotonic(), 0
while sent < len(at) - 1:
    time.sleep(0.01)
    due = int(min(len(at) - 1, (time.monotonic() - began) * rate))
    batch = data[at[sent] : at[due]]
    for ours, _ in ports:
        try:
            os.write(ours, batch)
        except BlockingIOError:
            pass
    sent = due
print(sent, flush=True)
sys.stdin.readline()
"""


class Line(NamedTuple):
    """What a device says, and how it is opened.

    Attributes
    ----------
    url : address, ``{}`` in the place of the port
    greeting : bytes before all samples
    samples : bytes of each sample

    """

    url: str
    greeting: bytes
    samples: list[bytes]


def serial(name: str) -> Line:
    """A device on a serial port."""
    data = codecs.stream(name, SAMPLES)
    parts = np.frombuffer(data, f"V{len(data) // SAMPLES}")
    url = f"serial:{{}}?{codecs.TOLD.get(name, '')}format={name}"
    return Line(url, b"", [part.tobytes() for part in parts])


def can() -> Line:
    """A device of three frames a sample, behind an adapter."""
    packed = frames(VirtualDevice(Profile(), seed=1).take(SAMPLES))
    lines = [b"t%03X8%s\r" % (f.identifier, f.data.hex().encode()) for f in packed]
    samples = [b"".join(lines[i : i + 3]) for i in range(0, len(lines), 3)]
    return Line("can:{}?interface=slcan&dbc=virtual", b"", samples)


def autopilot() -> Line:
    """An autopilot that is asked for nothing."""
    heartbeat, samples = mavlink.packets(MESSAGE, SAMPLES)
    return Line(f"mavlink:{{}}?message={MESSAGE}&rate=0", heartbeat, samples)


def carried(line: Line, count: int) -> tuple[int, int, float]:
    """Samples sent to each, the most that one of the drivers lost, share of a core."""
    cores = sorted(os.sched_getaffinity(0))
    with TemporaryDirectory() as folder, ExitStack() as stack:
        ends = "\n".join(map(str, accumulate(map(len, line.samples))))
        for name, content in (
            ("greeting", line.greeting),
            ("data", b"".join(line.samples)),
            ("ends", ends.encode()),
        ):
            Path(folder, name).write_bytes(content)
        sender = stack.enter_context(
            subprocess.Popen(
                [sys.executable, "-c", SENDER, folder, str(count), str(RATE)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
            )
        )
        told, orders = sender.stdout, sender.stdin
        if told is None or orders is None:
            raise AssertionError
        urls = [line.url.format(told.readline().strip()) for _ in range(count)]
        os.sched_setaffinity(0, cores[:1])
        stack.callback(os.sched_setaffinity, 0, cores)
        with ThreadPoolExecutor(count) as pool:  # some listen for a while at first
            drivers = list(pool.map(open_driver, urls))
        orders.write("\n")
        orders.flush()
        got, share = heard(drivers)
        sent = int(told.readline())
        for driver in drivers:
            driver.close()
        orders.write("\n")
        orders.close()
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
    lines = {name: serial(name) for name in FORMATS}
    for name, line in {**lines, "slcan": can(), "mavlink": autopilot()}.items():
        for count in COUNTS:
            sent, lost, share = carried(line, count)
            print(f"{name:10} {count:7} {sent:6} {lost:5}  {100 * share:6.0f} %")
            if lost:
                break
