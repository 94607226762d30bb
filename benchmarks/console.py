"""How often the console's screen is drawn anew, and whether a sample is lost for it.

`fieldcal run` at a terminal of 80 by 24 listens to a device of 1 kHz in another
process. Each drawing tells how many samples have come, so a drawing is counted where
that number is another one than before; the recording says what is missing.
"""

import re
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from time import monotonic

import numpy as np
import pexpect

from fieldcal.run.movers import VirtualMover
from fieldcal.session.folder import Session

RATE = 1000.0
"""Samples a second."""

SECONDS = 20.0
"""Averaging time of each of the two positions, s."""

TURNED = ((0.0, 0.0), (45.0, 5.0))
"""Where the device is turned to, deg."""

COUNT = re.compile(r"· (\d+) samples ·")
ASKED = re.compile(r"position (\d) of 2")


@dataclass
class Seen:
    """What was seen at the terminal.

    Attributes
    ----------
    times : host times at which another number of samples stood on the screen, s
    code : exit code of the run

    """

    times: list[float]
    code: int | None


def watch(folder: Path, wire: str = "mip") -> Seen:
    """Take a device through two positions at a terminal, and note each drawing."""
    options = ["--serial", wire, "--rate", str(RATE), "--latitude", "50.45"]
    with VirtualMover([*options, "--height", "170"]) as device:
        url = f"serial:{device.port}?format={wire}"
        call = ["-m", "fieldcal", "run", "two_position", "--device", url]
        call += [
            "--seconds",
            str(SECONDS),
            "-o",
            str(folder),
            "--no-report",
            "--level=0.01",
        ]
        call += ["--latitude", "50.45", "--height", "170"]
        child = pexpect.spawn(
            sys.executable, call, dimensions=(24, 80), encoding="utf-8", timeout=60
        )
        times: list[float] = []
        counted, rest, placed = "", "", 1
        while True:
            try:
                rest += child.read_nonblocking(1 << 16, timeout=10)
            except pexpect.EOF:
                break
            if found := COUNT.findall(rest):
                if found[-1] != counted:
                    counted = found[-1]
                    times.append(monotonic())
                if (asked := ASKED.findall(rest)) and int(asked[-1]) > placed:
                    placed = int(asked[-1])
                    alpha, beta = TURNED[placed - 1]
                    device.ask(turn={"alpha_deg": alpha, "beta_deg": beta})
                rest = ""
        child.close()
        return Seen(times, child.exitstatus)


def main() -> None:
    """Print drawings a second, and samples lost."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "s"
        seen = watch(folder)
        block = Session.open(folder).block
    steps = np.diff(seen.times)
    whole = RATE * (block.t[-1] - block.t[0])
    table = {
        "exit code": seen.code,
        "seconds at the screen": f"{seen.times[-1] - seen.times[0]:.1f}",
        "drawings": len(seen.times),
        "drawings a second": f"{1 / steps.mean():.2f}",
        "of 1 s the fewest drawings": _fewest(np.array(seen.times)),
        "longest time without one, s": f"{steps.max():.2f}",
        "samples": len(block),
        "samples lost": round(whole) + 1 - len(block),
        "longest step between two, samples": f"{RATE * np.diff(block.t).max():.2f}",
    }
    for what, value in table.items():
        print(f"{what:36} {value}")


def _fewest(times: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> int:
    """Fewest drawings in any second between the first and the last."""
    starts = times[times < times[-1] - 1.0]
    return int(
        (np.searchsorted(times, starts + 1.0) - np.searchsorted(times, starts)).min()
    )
