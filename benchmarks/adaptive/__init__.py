"""Devices with something concealed, recalibrated by `adaptive` and by a fixed plan.

    python -m benchmarks adaptive [DEVICES] [--seed=N] [--each]

Every device is drawn with its place, noise, tilted base and fixture; a third of them
conceals nothing, the others one effect or two. Each is led twice through the engine, on
device time: as `adaptive` asks, and through all nine positions of the same ladder.
Afterwards it is put into positions that neither took, where what the calibration says
of the force is held against a perfect device's. Half as many windows have half the
information: what the best set of as many positions leaves is printed as well.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np

from benchmarks._words import how_many, option
from benchmarks.adaptive.bench import Bench, drawn
from benchmarks.adaptive.least_error import error as error
from benchmarks.adaptive.least_error import least
from benchmarks.adaptive.led import APART, Run, led
from fieldcal.core.errors import FieldcalError
from fieldcal.core.positions import TWO_POSITIONS
from fieldcal.procedures.adaptive import LADDER

USUAL, SEED = 60, 71_000_000

NINE = [(float(a), float(b)) for a, b in product((0, -45, 45), (0, -5, 5))]
"""The fixed plan: all positions of the ladder."""

HALF = len(NINE) / 2
"""Positions in which it is to be GO, or what is wrong named."""

WRONG = 5.0
"""Standard uncertainties from which a parameter is wrong."""


def main() -> None:
    """Print what became of each plan."""
    count, seed = how_many(USUAL), int(option("seed", str(SEED)))
    plans = {
        "adaptive": ({"procedure": "adaptive"}, None),
        "nine fixed": ({"procedure": "positions"}, NINE),
    }
    rows: dict[str, list[tuple[Bench, Run]]] = {name: [] for name in plans}
    for number in range(seed, seed + count):
        bench = drawn(number, np.random.default_rng(number))
        told = f"{number} {', '.join(bench.session.concealed) or 'nothing'}:"
        try:
            found = {n: led(bench, *plan, number) for n, plan in plans.items()}
        except FieldcalError as error:
            print(f"{told} {error}", flush=True)
            continue
        for name, one in found.items():
            rows[name].append((bench, one))
        if "--each" in sys.argv:
            parts = [
                f"{n} {r.held} ({r.until_go:.0f}) {'GO' if r.go else 'NO-GO'}"
                f"{' named' * r.named}"
                f" {1e3 * r.error:.2f} mm/s^2 {r.off:.1f} sigma"
                for n, r in found.items()
            ]
            print(f"{told} {'; '.join(parts)}", flush=True)
    _print(rows)


def _print(rows: Mapping[str, Sequence[tuple[Bench, Run]]]) -> None:
    for concealed in (False, True):
        print("with something concealed" if concealed else "nothing concealed")
        print(
            "| plan | devices | positions | until GO | in half | GO | GO or named |"
            " error, rms | > 5 sigma |"
        )
        print("|---|---|---|---|---|---|---|---|---|")
        for name, some in rows.items():
            runs = [r for b, r in some if bool(b.session.concealed) == concealed]
            if not runs:
                continue
            print(_row(name, runs, concealed))
    _print_errors(rows)
    took = np.array([s for _, r in rows["adaptive"] for s in r.choices])
    print(
        f"choice: median {np.median(took):.2f} s, 95 % {np.quantile(took, 0.95):.2f} s"
        " of processor time"
    )


def _row(name: str, runs: Sequence[Run], concealed: bool) -> str:
    held = np.array([r.held for r in runs])
    first = np.array([r.until_go for r in runs])
    half = sum(
        f <= HALF or (r.named and concealed and r.held <= HALF)
        for f, r in zip(first, runs, strict=True)
    )
    error = 1e3 * np.nanmedian([r.error for r in runs])
    good = sum(r.go or (r.named and concealed) for r in runs)
    wrong = sum(r.go and r.off > WRONG for r in runs)
    return (
        f"| {name} | {len(runs)} | {held.mean():.1f} (median {np.median(held):.0f}) |"
        f" {np.nanmean(first):.1f} | {half} | {sum(r.go for r in runs)} | {good} |"
        f" {error:.2f} mm/s^2 | {wrong} |"
    )


def _print_errors(rows: Mapping[str, Sequence[tuple[Bench, Run]]]) -> None:
    """Print the errors of the force, and the least that there may be."""
    ratio = [
        a.error / b.error
        for (_, a), (_, b) in zip(*rows.values(), strict=True)
        if np.isfinite(a.error + b.error)
    ]
    print(f"error of adaptive over that of nine: median {np.median(ratio):.2f}")
    stated = float(np.median([b.angles_deg for b, _ in rows["adaptive"]]))
    begun = [p.degrees or (0.0, 0.0) for p in TWO_POSITIONS]
    nine = error(NINE, APART, stated)
    for count in (4, 5, 6):
        best = least(count, begun, list(product(*LADDER)), APART, stated) / nine
        print(f"least of the best {count} positions over that of nine: {best:.2f}")
