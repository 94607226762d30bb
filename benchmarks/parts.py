"""Random parts of published recordings: answered or refused, no error of its own.

    python -m benchmarks parts [PARTS] [--seed=N]

Part of a recording of `recordings` is told as a table of its own: some of its length,
every second or third sample, samples lost, a gap, its axes in another order, without
gyroscopes or thermometer. It is imported, diagnosed and solved, with cross-coupling and
without. Nobody knows the right answer; a traceback or a warning of a library is none.
"""

from __future__ import annotations

import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from time import process_time
from typing import NamedTuple

import numpy as np

from benchmarks._words import how_many, option, ran
from benchmarks.injected.recorded import REAL
from benchmarks.recordings import PUBLISHED, imported
from fieldcal.core.samples import Array, Block
from fieldcal.session.folder import Session

USUAL, SEED = 60, 61_000_000

COMMANDS = (("diagnose",), ("solve",), ("solve", "--cross"))

ANSWERED, REFUSED = (0, 1), 2
"""Exit codes."""


class Table(NamedTuple):
    """Names of columns, and samples by them."""

    names: tuple[str, ...]
    samples: Array


class Tried(NamedTuple):
    """A command on one part: its exit code, what it wrote, and how long it took, s."""

    command: str
    code: int
    said: str
    seconds: float

    @property
    def broken(self) -> bool:
        """Whether it ended in an error of its own, or let a library's warning pass."""
        return self.code not in (*ANSWERED, REFUSED) or "Warning:" in self.said


def part_of(block: Block, rng: np.random.Generator) -> Table:
    """A random part of a recording."""
    share = rng.uniform(0.15, 1.0)
    first = int(rng.uniform(0, 1 - share) * len(block))
    kept = np.arange(
        first, first + int(share * len(block)), rng.choice([1, 1, 1, 2, 3])
    )
    if rng.random() < 0.3:
        kept = kept[rng.random(len(kept)) > rng.uniform(0, 0.1)]
    if rng.random() < 0.3:
        gap = rng.integers(len(kept))
        kept = np.delete(kept, slice(gap, gap + len(kept) // 10))
    axes = np.eye(3)
    if rng.random() < 0.5:
        axes = axes[rng.permutation(3)] * rng.choice([-1.0, 1.0], (3, 1))
    names = ["time_s", *(f"acc_{i}_m_s2" for i in "xyz")]
    columns = [block.t[kept] - block.t[kept[0]], *(axes @ block.acc[kept].T)]
    if rng.random() > 0.15:
        names += [f"gyr_{i}_rad_s" for i in "xyz"]
        columns += [*(axes @ block.gyr[kept].T)]
    if np.isfinite(block.temperature).all() and rng.random() < 0.6:
        names.append("temp_degc")
        columns.append(block.temperature[kept])
    return Table(tuple(names), np.column_stack(columns))


def tried(table: Table, place: Path) -> Iterator[Tried]:
    """Every command on a part, the import first."""
    path, out = place / "part.csv", place / "part"
    np.savetxt(path, table.samples, "%.9g", ",", header=",".join(table.names),
               comments="")  # fmt: skip
    began = process_time()
    code, _, said = ran(["import", str(path), "-o", str(out)])
    yield Tried("import", code, said, process_time() - began)
    if code:
        return
    for command, *options in COMMANDS:
        began = process_time()
        code, _, said = ran([command, str(out), "--json", *options])
        yield Tried(" ".join([command, *options]), code, said, process_time() - began)


def recordings(place: Path) -> Iterator[tuple[str, Block]]:
    """Every published recording that can be imported, with its name."""
    for i, one in enumerate(PUBLISHED):
        _, folder = imported(one, place / str(i))
        if folder is not None:
            yield f"{one.folder} {one.stream}".strip(), Session.open(folder).block


def main() -> None:
    """Print what broke as it comes, and the table."""
    if not REAL.is_dir():
        print(f"the recordings are not here: {REAL}")
        return
    found: list[Tried] = []
    with tempfile.TemporaryDirectory() as place:
        every = list(recordings(Path(place)))
        first = int(option("seed", str(SEED)))
        for seed in range(first, first + how_many(USUAL)):
            rng = np.random.default_rng(seed)
            name, block = every[rng.integers(len(every))]
            with tempfile.TemporaryDirectory() as own:
                for one in tried(part_of(block, rng), Path(own)):
                    found.append(one)
                    if one.broken:
                        print(f"seed {seed}, {name}: {one.command} {one.said[-200:]}")
    _print(found)


def _print(found: list[Tried]) -> None:
    """A row for each command."""
    print("| command | parts | answered | refused | broken | s, median and longest |")
    print("|---|---|---|---|---|---|")
    for command in dict.fromkeys(one.command for one in found):
        some = [one for one in found if one.command == command]
        codes = Counter(one.code for one in some if not one.broken)
        answers = sum(codes[code] for code in ANSWERED)
        seconds = [one.seconds for one in some]
        print(
            f"| {command} | {len(some)} | {answers} | {codes[REFUSED]}"
            f" | {sum(one.broken for one in some)}"
            f" | {np.median(seconds):.1f}, {max(seconds):.1f} |"
        )
