"""The share of a processor that a device takes in real time, through its driver."""

import subprocess
import sys
from time import perf_counter, process_time, sleep
from typing import NamedTuple

from fieldcal.drivers.driver import open_driver

WATCHED = 5.0
"""Time over which the share is taken, s."""


class Load(NamedTuple):
    """What hearing a device takes.

    Attributes
    ----------
    share : of a core, 1 for all of it
    heard : samples a second

    """

    share: float
    heard: float


def load_at_1_khz(options: list[str], url: str) -> Load:
    """Hear a virtual device at 1 kHz.

    Parameters
    ----------
    options : of ``fieldcal sim``, which name the link
    url : what a driver opens, ``{}`` in the place of where the device is

    """
    command = [sys.executable, "-m", "fieldcal", "sim", "--rate", "1000", *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as sim:
        if sim.stdout is None:
            raise AssertionError
        place = sim.stdout.readline().strip()
        with open_driver(url.format(place)) as imu:
            for _ in imu.blocks():
                break
            began, spent, n = perf_counter(), process_time(), imu.health.samples
            for _ in imu.blocks():
                if perf_counter() - began > WATCHED:
                    break
            took, spent = perf_counter() - began, process_time() - spent
            heard = (imu.health.samples - n) / took
        sim.terminate()
    sleep(0.1)
    return Load(spent / took, heard)
