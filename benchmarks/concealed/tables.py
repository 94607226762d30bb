"""The tables that the benchmark prints."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence

import numpy as np

from benchmarks.concealed.draws import EQUATIONS
from benchmarks.concealed.judging import Outcome
from benchmarks.concealed.others import LABELS

GROUPS: dict[str, Callable[[Outcome], bool]] = {
    "nothing left out": lambda o: o.label.startswith("nothing"),
    "one effect with an equation": lambda o: o.label in EQUATIONS,
    "a broken chain, chance, others": lambda o: (
        o.label not in EQUATIONS
        and o.label not in LABELS.values()
        and not o.label.startswith(("nothing", "outside"))
    ),
    "two effects": lambda o: o.label == LABELS[2],
    "three effects": lambda o: o.label == LABELS[3],
    "outside the catalogue": lambda o: o.label.startswith("outside"),
}
SIZES = (0.0, 10.0, 14.0, 20.0, 30.0, np.inf)
NORMAL = 1.96


def printed(found: Sequence[Outcome]) -> None:
    """Print every table."""
    for table in (groups, confusion, power, reliability, numbers):
        print(table(found), end="\n\n")


def groups(found: Sequence[Outcome]) -> str:
    """How often each group of sessions is told right."""
    lines = [
        "| concealed | sessions | named right | or by an alias | something false |",
        "|---|---|---|---|---|",
    ]
    for name, belongs in GROUPS.items():
        some = [o for o in found if belongs(o)]
        if some:
            direct = sum(o.right and not o.aliased for o in some)
            right = sum(o.right for o in some)
            false = sum(bool(o.extra) for o in some)
            lines.append(
                f"| {name} | {len(some)} | {_part(direct, some)} | {_part(right, some)}"
                f" | {_part(false, some)} |"
            )
    return "\n".join(lines)


def confusion(found: Sequence[Outcome]) -> str:
    """What was said of every kind of session."""
    lines = ["| concealed | right | what was said instead |", "|---|---|---|"]
    for label in dict.fromkeys(o.label for o in found):
        some = [o for o in found if o.label == label]
        wrong = Counter(_said(o) for o in some if not o.right)
        others = "; ".join(f"{name} ({n})" for name, n in wrong.most_common())
        lines.append(
            f"| {label} | {sum(o.right for o in some)}/{len(some)} | {others} |"
        )
    return "\n".join(lines)


def _said(one: Outcome) -> str:
    return " + ".join(sorted(one.named)) or one.verdict


def power(found: Sequence[Outcome]) -> str:
    """How often an effect is named, by its size in standard deviations."""
    lines = ["| size, sigma | sessions | named right |", "|---|---|---|"]
    single = [o for o in found if o.label in EQUATIONS]
    for low, high in zip(SIZES[:-1], SIZES[1:], strict=True):
        some = [o for o in single if low <= o.sigmas < high]
        if some:
            name = f"{low:g} to {high:g}" if np.isfinite(high) else f"from {low:g}"
            right = sum(o.right for o in some)
            lines.append(f"| {name} | {len(some)} | {_part(right, some)} |")
    return "\n".join(lines)


def reliability(found: Sequence[Outcome]) -> str:
    """Of what is said with a probability, how much is so; and the log score."""
    claims = np.array([c for o in found for c in o.claims], dtype=float).reshape(-1, 2)
    if not len(claims):
        return "nothing is said with a probability"
    lines = ["| said with P | how often | mean P | is so |", "|---|---|---|---|"]
    for low in np.arange(0.5, 1.0, 0.1):
        top = 1.0 + 1e-9 if low > 0.85 else low + 0.1
        some = claims[(claims[:, 0] >= low - 1e-9) & (claims[:, 0] < top)]
        if len(some):
            lines.append(
                f"| {low:.1f} to {min(top, 1.0):.1f} | {len(some)} |"
                f" {100 * some[:, 0].mean():.1f} % | {100 * some[:, 1].mean():.1f} % |"
            )
    sure = np.clip(np.where(claims[:, 1] > 0, claims[:, 0], 1 - claims[:, 0]), 1e-6, 1)
    lines.append(f"\nlog score {float(np.log(sure).mean()):.3f} a claim")
    return "\n".join(lines)


def numbers(found: Sequence[Outcome]) -> str:
    """How the numbers hold, and what is gained on what was left out of the fit."""
    pulls = np.array([p for o in found for p in o.pulls.values()])
    out = []
    if len(pulls):
        inside = [100 * float(np.mean(np.abs(pulls) < k)) for k in (1, NORMAL, 3)]
        out.append(
            f"{len(pulls)} numbers: {inside[0]:.1f} % within 1 sigma, {inside[1]:.1f} %"
            f" in their 95 % interval, {inside[2]:.1f} % within 3 sigma"
        )
    gains = [
        1 - o.after / o.before
        for o in found
        if o.right and o.verdict == "left_out" and o.before > 0 and o.label in EQUATIONS
    ]
    if gains:
        better = 100 * float(np.mean(np.array(gains) > 0))
        out.append(
            f"held-out rms falls by {100 * np.median(gains):.0f} % (median), in"
            f" {better:.0f} % of the sessions with one effect named"
        )
    seconds = [o.seconds for o in found]
    out.append(f"{np.median(seconds):.1f} s a diagnosis (median)")
    return "\n".join(out)


def _part(count: int, of: Sequence[Outcome]) -> str:
    return f"{100 * count / len(of):.1f} %"
