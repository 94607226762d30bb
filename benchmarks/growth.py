"""How processor time grows with positions, length and effects, of the whole command.

Sessions of the virtual device at 100 Hz; start-up included, the best of three.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.diagnose import ANGLES, COUPLED, Parameters, record

RUNS = 3
RATE_HZ = 100.0
LADDER = [(a, b) for a in (0.0, 30.0, 60.0, 90.0, -30.0, -60.0, -90.0, 180.0)
          for b in (0.0, 5.0, -5.0, 45.0, -45.0)]  # fmt: skip
EFFECTS: list[Parameters] = [
    {},
    COUPLED,
    {**COUPLED, "bias_drift": {"gx": 1e-5}},
    {**COUPLED, "bias_drift": {"gx": 1e-5}, "scale_asymmetry": {"x": 3e-3}},
]


def spent(command: str, folder: str) -> float:
    """Processor time of a command, user and system, s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    words = [sys.executable, "-m", "fieldcal", command, folder]
    subprocess.run(words, capture_output=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def row(
    label: str, seconds: float, angles: list[tuple[float, float]], there: Parameters
) -> None:
    """Print one session's times."""
    with tempfile.TemporaryDirectory() as folder:
        record(Path(folder), RATE_HZ, seconds, angles, there)
        times = [
            min(spent(command, folder) for _ in range(RUNS))
            for command in ("diagnose", "solve")
        ]
    print(f"{label:28} {times[0]:8.2f} s {times[1]:8.2f} s", flush=True)


def main() -> None:
    """Print seconds of processor time of diagnose and solve."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    print(f"{'':28} {'diagnose':>10} {'solve':>10}")
    for count in (5, 9, 20, 40):
        angles = ANGLES if count == len(ANGLES) else LADDER[:count]
        row(f"{count} positions of 30 s", 30.0, angles, COUPLED)
    for seconds in (120.0, 480.0):
        row(f"9 positions of {seconds:g} s", seconds, ANGLES, COUPLED)
    for there in EFFECTS:
        row(f"9 positions, {len(there)} effects", 30.0, ANGLES, there)
