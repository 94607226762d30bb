"""Sessions with one or two mistakes drawn at random: GO is never to be wrong.

    python -m benchmarks never_wrong [SESSIONS] [--seed=N] [--only=MISTAKE] [--diagnose]

A third of the sessions is sound. Of the others, each has one mistake, and one in four a
second. GO with a parameter more than five of its standard uncertainties off is wrong.
"""

from __future__ import annotations

import sys
import tempfile
from collections import Counter, defaultdict
from pathlib import Path

import numpy as np

from benchmarks.never_wrong.bench import drawn
from benchmarks.never_wrong.judging import WRONG, Judged, judged, write
from benchmarks.never_wrong.mistakes import AFTER, BEFORE, session

USUAL, SEED = 150, 84_000_000
SOUND = "none"
"""Name of the row of sound sessions."""


def mistakes(number: int, rng: np.random.Generator, only: str) -> tuple[str, ...]:
    """Mistakes of a session by its number; none in every third."""
    names = [*BEFORE, *AFTER]
    if only:
        return () if only == SOUND else (only,)
    if number % 3 == 0:
        return ()
    first = names[(number - number // 3 - 1) % len(names)]
    more = [n for n in names if n != first]
    return (first, str(rng.choice(more))) if rng.random() < 0.25 else (first,)


def main() -> None:
    """Print what became of each mistake, and by which check it was caught."""
    words = sys.argv[2:]
    count = next((int(w) for w in words if w.isdigit()), USUAL)
    given = {k: v for k, _, v in (w[2:].partition("=") for w in words if w[:2] == "--")}
    seed = int(given.get("seed", SEED))
    rows: dict[str, list[Judged]] = defaultdict(list)
    for k in range(count):
        rng = np.random.default_rng(seed + k)
        bench = drawn(rng)
        names = mistakes(k, rng, given.get("only", ""))
        with tempfile.TemporaryDirectory() as where:
            folder = Path(where) / "session"
            write(folder, session(bench, names, rng))
            one = judged(folder, bench.truth, "diagnose" in given)
        rows[" + ".join(names[:1]) or SOUND].append(one)
        wrong = one.off > WRONG if one.go else not names
        if wrong or "each" in given:
            what = "GO" if one.go else f"NO-GO ({one.caught}: {one.says})"
            print(
                f"seed {seed + k} {bench.places}, {', '.join(names) or SOUND}: {what},"
                f" {one.off:.1f} σ ({one.worst}) {one.verdict}",
                flush=True,
            )
    _print(rows)


def _print(rows: dict[str, list[Judged]]) -> None:
    print("| mistake | sessions | GO | GO, > 5 σ off | caught by |")
    print("|---|---|---|---|---|")
    for name, some in rows.items():
        go = [one for one in some if one.go]
        wrong = sum(one.off > WRONG for one in go)
        caught = Counter(one.caught for one in some if not one.go)
        by = ", ".join(f"{what} {n}" for what, n in caught.most_common())
        print(f"| {name} | {len(some)} | {len(go)} | {wrong} | {by} |")
    leaked = sum(one.leaked for some in rows.values() for one in some)
    print(f"warnings of libraries that came through: {leaked}")
