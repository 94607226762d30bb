"""Real recordings beside the project in which a device lies still for a minute or more.

Half of each must be 30 s long, the least that noise is estimated from. Most recordings
have shorter rests: the longest of those turned by hand lasts 37 s, of the boards with
eight devices 33 s, and each attitude of the autopilot (a simulator) 20 s; the car and
the bursts of 5 s have none. One recording has 74 s after a turn by 90 degrees, but that
device slipped by 0.2 degrees on the way and trembles twice as much as before.
"""

from __future__ import annotations

import gzip
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from benchmarks.injected.recorded import REAL, TEN_MINUTES, at_rest_for, recordings
from benchmarks.noise.processes import recording
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Block

COUNTS = np.repeat([G0 / 16384, np.pi / 180 / 131], 3)
"""What a count of an MPU-6050 is worth, m/s^2 and rad/s."""

COUNTED_HZ = 100.0
PUT_DOWN_S = 8.0
"""Time after which the autopilot's board lies still."""


def rests() -> Iterator[tuple[str, Block]]:
    """Each rest with its name, as evenly sampled as it was taken."""
    for name, make in SOURCES.items() if REAL.is_dir() else ():
        yield name, make()


def _counted(name: str) -> Block:
    path = REAL / "tomisuarez_mpu6050" / f"{name}.csv.gz"
    with gzip.open(path, "rt") as text:
        rows = np.genfromtxt(text, delimiter=",", skip_header=4)[:, :6]
    return recording(rows[np.isfinite(rows).all(axis=1)] * COUNTS, 1 / COUNTED_HZ)


def _on_a_table(name: str) -> Block:
    return _even(at_rest_for(name)[0])  # stamps tell when bursts of samples came


def _autopilot() -> Block:
    block, _ = recordings()["pyulog"]()
    return _even(block[int(np.searchsorted(block.t, block.t[0] + PUT_DOWN_S)) :])


def _even(block: Block) -> Block:
    return recording(block.six, float(block.t[-1] - block.t[0]) / (len(block) - 1))


SOURCES: dict[str, Callable[[], Block]] = {
    "MPU-6050, 655 s": partial(_on_a_table, TEN_MINUTES),
    "MPU-6050, 449 s": partial(_counted, "example_data_tinit_calc"),
    "MPU-6050, 100 s": partial(_counted, "imu_static_test"),
    "MPU-6050, 63 s": partial(_on_a_table, "set-1__unmoved-z-pointing-left"),
    "PX4 autopilot, 61 s": _autopilot,
}
