"""Sessions with one or two mistakes drawn at random: GO is never to be wrong.

    python -m benchmarks never_wrong [SESSIONS] [--seed=N] [--limit=S] [--only=MISTAKE]
        [--diagnose] [--each]

A third of the sessions is sound. Of the others, each has one mistake, and one in four a
second. GO with a parameter more than five of its standard uncertainties off, or known
worse than its limit, is wrong, and so is a session that takes longer than `--limit`
seconds of processor time. Limits are bounds on standard uncertainties, so a parameter
may be off by more than its limit; the table has how many are, and how many the
uncertainties lead one to expect. Session k of seed N is session 0 of seed N + k, so a
campaign can be run in slices; one that is interrupted (ctrl-c) prints its table.
"""

from __future__ import annotations

import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.never_wrong.bench import Bench, drawn
from benchmarks.never_wrong.bench_mistakes import BEFORE, spoilt
from benchmarks.never_wrong.judging import Judged, judged, write
from benchmarks.never_wrong.mistakes import AFTER, session

USUAL, SEED, LONGEST = 150, 84_000_000, 60.0
SOUND = "none"
"""Name of the row of sound sessions."""

GROUPED = {
    SOUND: (SOUND,),
    "the faces left out, by which gravity bears witness to angles": (
        "faces left out",
    ),
    "positions in the wrong order, one forgotten": (
        "positions swapped", "a position forgotten",
    ),
    "angles exchanged, counted the other way, in radians, as a slope, read coarsely": (
        "angles exchanged", "an angle counted the other way", "angles in radians",
        "angles as a slope", "angles read coarsely",
    ),
    "windows that begin or end while it is turned": (
        "windows begun early", "windows ended late",
    ),
    "a position, an angle, or the gauge off": (
        "a position off", "a repeated angle off", "gauge long",
        "two positions or angles off",
    ),
    "table tilted, kicked or sinking; level not said or wrong; angles not said": (
        "table tilted", "table kicked", "ground gives way", "level and angles not said",
        "level said wrongly",
    ),
    "a device that slips in its mount, or is fastened askew": (
        "slips in its mount", "fastened askew",
    ),
    "latitude not said, its sign wrong, gravity wrong": (
        "latitude not said", "only gravity said", "other hemisphere",
        "gravity said wrongly",
    ),
    "mounting not said; outputs or triads reversed or exchanged": (
        "mounting not said", "an output reversed", "outputs exchanged",
        "a triad reversed", "triads in other axes",
    ),
    "another unit (g, deg/s, rad/s)": (
        "g labelled m/s²", "deg/s labelled rad/s", "rad/s labelled deg/s",
    ),
    "time in ns, windows twice, a copied or stuck output": (
        "time in ns", "windows overlapping", "windows listed 20 times",
        "a gyroscope copied", "an output stuck",
    ),
    "lost samples, wrong bits, lines between samples, few digits, coarse times": (
        "samples lost, time counted", "lost samples as zeros", "lost samples repeated",
        "wrong bits", "resampled", "rates with few digits", "coarse times",
    ),
    "a restart, or a gap, between positions; turns not recorded": (
        "device restarted", "a gap between positions", "turns not recorded",
    ),
    "a mean or a bias taken out": (
        "mean of acc removed", "mean of acc removed, rounded", "bias of gyr tracked",
    ),
    "a low-cost device": ("low-cost device",),
    "vibration, sway": ("vibration", "sway"),
    "filter, delay of the gyroscopes, lever arm": (
        "filter", "delay of the gyroscopes", "lever arm",
    ),
    "biases that warm up, wander, or keep something of a turn": (
        "warm-up", "wandering biases", "bias that a turn leaves",
    ),
    "cut toward zero, clipped, wrapped around": (
        "cut toward zero", "clipped", "wrapped around",
    ),
    "joints not square, with play, bent, settling; a position held twice": (
        "joints not square", "play of the joints", "fixture bends", "fixture settles",
        "not turned",
    ),
    "an engine or a hand in some positions, the sun": (
        "engine at times", "held by hand", "sun",
    ),
    "another plan, a sign forgotten, gon, mil or mrad": (
        "plan of another session", "a sign forgotten", "angles in gon, mil or mrad",
    ),
    "samples held, out of order, of two clocks; a clock set; significant digits": (
        "sampled and held", "packets out of order", "sensors on two clocks",
        "clock set", "few significant digits",
    ),
    "gravity's direction alone; a device that calibrates itself; a falling supply": (
        "gravity's direction alone", "calibrates itself", "supply falls",
    ),
    "corrected in steps, biases that shift at times, axes of the screen, smoothed": (
        "corrected in steps", "biases shifted at times", "axes of the screen",
        "smoothed",
    ),
    "two days, two devices or two mountings in one": (
        "two days joined", "device exchanged", "device remounted",
        "a second device heard",
    ),
    "high-passed, zeroed at stops, a dead band, sent on change, clipped in turns": (
        "acc high-passed", "gyr zeroed at each stop", "dead band", "sent on change",
        "gyr clipped in turns",
    ),
}  # fmt: skip
"""Rows of the table: what it is about, and its mistakes."""


@dataclass(frozen=True)
class Options:
    """What is to be run.

    Attributes
    ----------
    count, seed : sessions, and the number of the first
    limit : s of processor time, for each
    only : mistake, empty for all
    diagnose, each : whether `diagnose` is asked as well; whether all are printed

    """

    count: int = USUAL
    seed: int = SEED
    limit: float = LONGEST
    only: str = ""
    diagnose: bool = False
    each: bool = False

    @classmethod
    def of(cls, words: Sequence[str]) -> Options:
        """Read the command line."""
        count = next((int(w) for w in words if w.isdigit()), USUAL)
        named = (w[2:].partition("=") for w in words if w[:2] == "--")
        given = {key: value for key, _, value in named}
        return cls(
            count,
            int(given.get("seed", SEED)),
            float(given.get("limit", LONGEST)),
            given.get("only", ""),
            "diagnose" in given,
            "each" in given,
        )


def mistakes(number: int, rng: np.random.Generator, only: str) -> tuple[str, ...]:
    """Mistakes of a session by its seed; none in every third."""
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
    options = Options.of(sys.argv[2:])
    rows: dict[str, list[Judged]] = defaultdict(list)
    with suppress(KeyboardInterrupt):  # a campaign that is stopped says what it found
        for seed in range(options.seed, options.seed + options.count):
            _try(seed, options, rows)
    _print(rows)


def draw_and_judge(
    seed: int, options: Options, names: tuple[str, ...] | None = None
) -> tuple[Bench, tuple[str, ...], Judged]:
    """One session, its mistakes, and what was said.

    They are drawn even if they are `names`, so that a session of a campaign of all
    mistakes remains the same if others are added to them.
    """
    rng = np.random.default_rng(seed)
    bench = drawn(rng)
    own = mistakes(seed, rng, options.only)
    names = own if names is None else names
    bench = spoilt(bench, names, rng)
    with tempfile.TemporaryDirectory() as where:
        folder = Path(where) / "session"
        written = session(bench, names, rng)
        write(folder, written)
        truth = written.truth(bench)
        one = judged(folder, truth, bench.grade, options.diagnose, options.limit)
    return bench, names, one


def _try(seed: int, options: Options, rows: dict[str, list[Judged]]) -> None:
    """One session, printed if it is not as it should be."""
    bench, names, one = draw_and_judge(seed, options)
    rows[names[0] if names else SOUND].append(one)
    odd = one.wrong or one.over if one.go else not names
    if odd or one.late or one.leaked or options.each:
        what = "GO" if one.go else f"NO-GO ({one.caught}: {one.says})"
        print(
            f"seed {seed} {bench.places}, {', '.join(names) or SOUND}: {what},"
            f" {one.off:.1f} σ ({one.worst}){', beyond a limit' * one.over}"
            f" {one.verdict}{', a warning came through' * bool(one.leaked)}",
            flush=True,
        )


def _print(rows: dict[str, list[Judged]]) -> None:
    print(
        "| mistake | sessions | GO | GO, and > 5 σ | GO, and off by more than a limit"
        " (expected) | refused by |"
    )
    print("|---|---|---|---|---|---|")
    for kind, names in GROUPED.items():
        some = [one for name in names for one in rows.get(name, ())]
        if not some:
            continue
        caught = Counter(_check(one.caught) for one in some if not one.go)
        by = ", ".join(f"{what} {n}" for what, n in caught.most_common())
        good = [one for one in some if one.go]
        wrong = sum(one.wrong for one in good)
        print(
            f"| {kind} | {len(some)} | {len(good)} | {wrong} | {_over(good)} | {by} |"
        )
    every = [one for some in rows.values() for one in some]
    good = [one for one in every if one.go]
    print(f"wrong GO: {sum(one.wrong for one in every)} of {len(every)}")
    print(f"GO, and off by more than a limit (expected): {_over(good)}")
    print(f"warnings of libraries that came through: {sum(o.leaked for o in every)}")


def _over(good: Sequence[Judged]) -> str:
    """How many are off by more than a limit, and how many are to be expected."""
    expected = sum(one.chance for one in good)
    return f"{sum(one.over for one in good)} ({expected:.1f})"


def _check(name: str) -> str:
    """What refused a session, by the kind of check."""
    if name.endswith("uncertainty"):
        return "uncertainty"
    return {"fit": "estimate", "exit 1": "estimate", "exit 2": "not readable"}.get(
        name, name
    )
