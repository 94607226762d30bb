"""Sessions recorded by a process that is killed, and what must be left of them."""

from __future__ import annotations

import random
import subprocess
import sys
from pathlib import Path

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.session.folder import Session
from fieldcal.session.recorder import Recorder

ROWS = 50
"""Samples that are handed over at once."""


def block(first: int, n: int = ROWS) -> Block:
    """Samples whose numbers tell which they are."""
    k = np.arange(first, first + n, dtype=float)
    return Block.of(k / 1000, np.column_stack([k, -k, k * k]), None, 20 + k, k)


def tell(first: int) -> None:
    """Say at once how many samples were written."""
    sys.stdout.write(f"{first}\n")
    sys.stdout.flush()


def record(folder: Path) -> None:
    """Record until killed; a line for each batch that is out of our hands."""
    with Recorder(folder, {"format": 1}) as recorder:
        first = 0
        while True:
            recorder.append(block(first))
            first += ROWS
            if first % 3:
                recorder.flush()
                tell(first)
            if first % 11 == 0:
                recorder.mark("told", text=f"{first} samples")
                tell(first)


def killed(folder: Path, seconds: float) -> int:
    """Have it recorded and killed after so long; samples that were surely written."""
    command = [sys.executable, __file__, str(folder)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        first = process.stdout.readline()
        try:
            process.wait(seconds)
        except subprocess.TimeoutExpired:
            process.kill()
        lines = [first, *process.stdout.read().split("\n")]
    return max(int(line) for line in lines if line.strip())


def faults(folder: Path, written: int) -> list[str]:
    """What is lost or invented in a session of which so many samples were written."""
    session = Session.open(folder)
    found = session.block
    wrong = []
    if len(found) < written:
        wrong.append(f"{written - len(found)} samples lost")
    if not same(found, block(0, len(found))):
        wrong.append("samples that were never recorded")
    marks = [m["text"] for m in session.marks() if m["event"] == "told"]
    if marks != [f"{550 * (i + 1)} samples" for i in range(len(marks))]:
        wrong.append("marks that were never made")
    return wrong


def same(found: Block, expected: Block) -> bool:
    """Whether all columns are the same."""
    pairs: list[tuple[Array, Array]] = [
        (found.t, expected.t),
        (found.acc, expected.acc),
        (found.temperature, expected.temperature),
        (found.seq, expected.seq),
    ]
    return all(np.array_equal(a, b) for a, b in pairs)


def moments(n: int, seed: int) -> list[float]:
    """When to kill, s after the first batch."""
    rng = random.Random(seed)
    return [rng.uniform(0.0, 0.4) for _ in range(n)]


if __name__ == "__main__":
    record(Path(sys.argv[1]))
