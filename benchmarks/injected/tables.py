"""The table that the benchmark prints, and what was wrong in each case."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from benchmarks.injected.judging import CONTROL, Outcome

HEAD = (
    "| added | cases | there already | named right | by alias | missed | lost |"
    " invented |\n|---|---|---|---|---|---|---|---|"
)


def line(label: str, some: Sequence[Outcome]) -> str:
    """One row: how many of some outcomes are what."""
    counts: list[Callable[[Outcome], bool]] = [
        lambda o: True,
        lambda o: o.already and o.effect != CONTROL,
        lambda o: o.named and not o.already,
        lambda o: o.aliased and not o.already,
        lambda o: o.missed,
        lambda o: bool(o.lost),
        lambda o: bool(o.invented),
    ]
    numbers = [str(sum(is_it(o) for o in some)) for is_it in counts]
    return f"| {label} | {' | '.join(numbers)} |"


def printed(found: Sequence[Outcome], untouched: Sequence[float]) -> None:
    """Print the table by effect, by size and in all."""
    print(HEAD)
    for effect in sorted({o.effect for o in found}):
        print(line(effect, [o for o in found if o.effect == effect]))
    print(line("all", found))
    for sigmas in sorted({o.sigmas for o in found}):
        some = [o for o in found if o.sigmas == sigmas and o.effect != CONTROL]
        print(line(f"{sigmas:g} sigma", some))
    print()
    right = sum(o.right for o in found)
    share = 100 * right / max(len(found), 1)
    print(f"{right} of {len(found)} cases without fault ({share:.1f} %)")
    seconds = np.array([*untouched, *(o.seconds for o in found)])
    if len(seconds):
        print(
            f"{len(seconds)} diagnoses: {np.median(seconds):.1f} s (median),"
            f" {seconds.max():.1f} s at most, {seconds.sum():.0f} s in all"
        )


def fault(one: Outcome) -> str:
    """What is wrong with an outcome, in a line."""
    words = [
        f"{one.effect} on {one.recording}, {one.sigmas:g} sigma (seed {one.seed};"
        f" {one.added}):"
    ]
    if one.missed:
        words.append("missed;")
    if one.lost:
        words.append(f"lost {', '.join(one.lost)};")
    if one.invented:
        words.append(f"invented {', '.join(one.invented)};")
    return f"{' '.join(words)} {one.said}"
