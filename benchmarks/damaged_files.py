"""Damaged files of every format through its importer.

    python -m benchmarks damaged_files [FILES] [--seed=N]

Of each format a small file is damaged: bytes are changed, left out, doubled, exchanged,
zeroed, or the end is missing; one to four times. Each is read, half of them with bad
rows left out. Printed is how many were read, and how many were refused with an error
that names the file; with any other error, or more samples than the damage can have
doubled, the first is printed with its number.
"""

import sys
import warnings
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

import numpy as np

from benchmarks._words import how_many, option
from fieldcal.core.errors import InputError

USUAL, SEED = 2000, 7_000_000


def damaged(content: bytes, rng: np.random.Generator) -> tuple[bytes, int]:
    """A file that something happened to, and bytes that it has twice."""
    data, more = bytearray(content), 0
    for _ in range(rng.integers(1, 5)):
        at = int(rng.integers(len(data)))
        end = at + int(np.exp(rng.uniform(0, np.log(len(content) / 2))))
        kind = rng.integers(6)
        if kind == 0:
            data[at] ^= 1 << int(rng.integers(8))
        elif kind == 1:
            data[at:end] = rng.bytes(len(data[at:end]))
        elif kind == 2:
            data[at:end] = bytes(len(data[at:end]))
        elif kind == 3 and len(data) > end - at:
            del data[at:end]
        elif kind == 4:
            more += len(data[at:end])
            data[end:end] = data[at:end]
        else:
            other = int(rng.integers(len(data)))
            data[at], data[other] = data[other], data[at]
    if rng.integers(4) == 0:
        del data[int(rng.integers(1, len(data) + 1)) :]
    return bytes(data), more


def outcome(small: Any, whole: Any, seed: int) -> str:
    """What becomes of one file: read, refused, or what went wrong."""
    rng = np.random.default_rng(seed)
    content, more = damaged(small.content, rng)
    small.path.write_bytes(content)
    try:
        found = whole(small.path, small.wanted, small.name, bool(rng.integers(2)))
    except InputError as error:
        named = small.path.name in str(error) or "imu.dbc" in str(error)
        return "refused" if named else f"refused without its name: {error}"
    except Exception as error:  # what is looked for
        return f"{type(error).__name__}: {error}"
    most = len(small.expected) * (1 + more / len(small.content) * 3)
    return "read" if len(found) <= most else f"{len(found)} samples of {most:.0f}"


def main() -> None:
    """Print, for each format, what came of damaged files."""
    sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
    from small_files import SMALL, Small, whole

    count, seed = how_many(USUAL), int(option("seed", str(SEED)))
    print(f"{'format':10} {'files':>7} {'read':>7} {'refused':>8} {'wrong':>6} ms each")
    for name in sorted(SMALL):
        with TemporaryDirectory() as folder, warnings.catch_warnings():
            warnings.simplefilter("error")
            small = Small(name, Path(folder) / "file")
            began, told = process_time(), {"read": 0, "refused": 0}
            for number in range(seed, seed + count):
                said = outcome(small, whole, number)
                if said not in told:
                    print(f"{name} {number}: {said}", flush=True)
                told[said] = told.get(said, 0) + 1
        wrong = count - told["read"] - told["refused"]
        each = 1000 * (process_time() - began) / count
        print(
            f"{name:10} {count:7} {told['read']:7} {told['refused']:8} {wrong:6}"
            f" {each:7.1f}",
            flush=True,
        )
