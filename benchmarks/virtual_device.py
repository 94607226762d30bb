"""How fast the virtual device runs: in process, played again, and over its pty."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from time import perf_counter

import numpy as np

from fieldcal.sim_device import Profile, VirtualDevice
from fieldcal.sim_device.replay import HeldWindow, simulate

SAMPLE = 33
PLACES = [HeldWindow(0.1 * k, 0.05, 3.0 + 39 * k, 33.0 + 39 * k) for k in range(9)]


def _seconds(do: Callable[[], object]) -> float:
    start = perf_counter()
    do()
    return perf_counter() - start


def _over_a_pty(n: int) -> float:
    """Seconds for `n` samples from another process, start-up left out."""
    command = [sys.executable, "-m", "fieldcal", "sim", "--speed", "max"]
    with subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True
    ) as sim:
        assert sim.stdout is not None  # noqa: S101
        port = os.open(sim.stdout.readline().strip(), os.O_RDWR | os.O_NOCTTY)
        left = n * SAMPLE - len(os.read(port, SAMPLE))
        start = perf_counter()
        while left > 0:
            left -= len(os.read(port, 65536))
        seconds = perf_counter() - start
        os.close(port)
        sim.terminate()
    return seconds


def main() -> None:
    """Print a table; 100 Hz unless it says otherwise."""
    still, moving = VirtualDevice(), VirtualDevice()
    moving.spin((0.1, 0.2, 0.3))
    hour = np.arange(3_600_000) / 1000
    rows = {
        "at rest, 1e6 samples": (1e6, lambda: still.take(1_000_000)),
        "turning, 1e6 samples": (1e6, lambda: moving.take(1_000_000)),
        "blocks of 10, 1e4 samples": (
            1e4,
            lambda: [still.take(10) for _ in range(1000)],
        ),
        "nine positions played again": (34_800, lambda: simulate(Profile(), PLACES)),
        "1 h at 1 kHz played again": (3.6e6, lambda: simulate(Profile(), PLACES, hour)),
    }
    print(f"{'':30} {'s':>8} {'samples/s':>12} {'times real time':>16}")
    for name, (n, do) in rows.items():
        seconds = _seconds(do)
        rate = 1000 if "kHz" in name else 100
        print(
            f"{name:30} {seconds:8.3f} {n / seconds:12.0f} {n / seconds / rate:16.0f}"
        )
    seconds = _over_a_pty(50_000)
    name = "over a pty, 5e4 samples"
    print(f"{name:30} {seconds:8.3f} {5e4 / seconds:12.0f} {500 / seconds:16.0f}")


if __name__ == "__main__":
    main()
