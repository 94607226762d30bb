"""What is there and no effect in the catalogue makes.

A random part of the model is one of: a function of something, of which nothing more is
known (its share of the variance and its correlation with that are given); windows that
are off each for itself; or scatter that all axes of a triad show alike, as biases that
wander do, which is named as random and is no unknown, unless the axes go in step.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.diagnosis.bench import Bench
from fieldcal.diagnosis.explain import Explanation, bare, wandering
from fieldcal.diagnosis.fit import Fit
from fieldcal.diagnosis.heldout import cells
from fieldcal.diagnosis.misplaced import Turned
from fieldcal.diagnosis.scatter import alike
from fieldcal.diagnosis.whiten import Part, factor, nameless
from fieldcal.effects import Experience
from fieldcal.samples import Array

STANDS = 3.5
ALIKE = 2
"""Axes of a triad that scatter together when biases wander."""

SMALL = 0.05
"""Part of what effects explain that is too little to be called unexplained."""


@dataclass(frozen=True, slots=True)
class Unknown:
    """A mismatch without an explanation.

    Attributes
    ----------
    kind : random part: "alpha", "time", "offset", "window 7" ...
    channel : index in `samples.CHANNELS`
    positions : where it stands out
    covariate : what it follows best
    correlation : with that
    share : part of its variance that a smooth function of `kind` takes
    rms : of the residual
    sigma : significance
    squares : of the residual, whitened
    turned : angles that would explain it, had a position been set at them

    """

    kind: str
    channel: int
    positions: tuple[int, ...]
    covariate: str
    correlation: float
    share: float
    rms: float
    sigma: float
    squares: float
    turned: tuple[Turned, ...] = ()


def unknowns(explanation: Explanation) -> list[Unknown]:
    """Every part of the model that is no effect of the catalogue."""
    parts = explanation.model.bench.errors.parts
    out = [p for p in parts if nameless(p.kind)]
    for first in (0, 3):
        scatter = _scatter(explanation, first)
        offsets = [p for p in scatter if p.kind == "offset"]
        if first in explanation.in_step:
            out += [replace(p, kind="time") if p.kind == "walk" else p for p in scatter]
        elif len(alike(offsets)) < ALIKE:
            out += alike(offsets)
    return [*_misset(explanation), *(_of(explanation, part) for part in out)]


def _misset(explanation: Explanation) -> Iterator[Unknown]:
    """Positions that were not set where they are said to have been."""
    if (unaware := explanation.unaware) is None:
        return
    for part in unaware.model.bench.errors.parts:
        turned = explanation.misset.get(-1 if part.window is None else part.window)
        if turned and part.channel < len("xyz"):
            yield replace(_of(unaware, part), turned=turned)


def walking(explanation: Explanation) -> list[Part]:
    """What is random in time: walks, and scatter that is as good as walks."""
    out = []
    for first in (0, 3):
        scatter = _scatter(explanation, first)
        offsets = [p for p in scatter if p.kind == "offset"]
        if first not in explanation.in_step:
            out += [p for p in scatter if p.kind == "walk"]
            out += offsets if len(alike(offsets)) >= ALIKE else []
    return out


def _scatter(explanation: Explanation, first: int) -> list[Part]:
    return wandering(explanation.model.bench.errors, first)


def _of(explanation: Explanation, part: Part) -> Unknown:
    bench, c = explanation.prepared.bench, part.channel
    _, fit = bare(explanation.prepared, explanation.model, explanation.fit)
    mean, sd, position = cells(bench.rows, fit.residual)
    z = np.nan_to_num(mean[:, c] / sd[:, c])
    squares = float((fit.white[:, c] ** 2).sum())
    excess = max(squares - float(bench.rows.used[:, c].sum()), 1.0)
    out = np.unique(position[np.abs(z) > STANDS])
    if part.window is not None:
        out = np.array([part.window])
    elif not len(out):
        out = position[[int(np.argmax(np.abs(z)))]]
    covariate, correlation = _follows(bench.rows.x, fit.residual[:, c], part)
    inside = np.isin(position, out)
    return Unknown(
        kind=part.kind,
        channel=c,
        positions=tuple(int(p) for p in out),
        covariate=covariate,
        correlation=correlation,
        share=_share(bench, fit, part),
        rms=float(np.sqrt(np.nanmean(mean[inside, c] ** 2))),
        sigma=float(np.sqrt(excess)),
        squares=excess,
    )


def _share(bench: Bench, fit: Fit, part: Part) -> float:
    """Part of the residual's variance that the smooth function takes."""
    c = part.channel
    use = bench.rows.used[:, c]
    f = bench.whiten.channel(factor(part.kind, bench.rows.x, c), c)[use]
    z = bench.whiten.channel(fit.residual[:, c, None], c)[use, 0]
    inner = f.T @ f + np.eye(f.shape[1]) / part.size**2
    taken = f @ np.linalg.solve(inner, f.T @ z)
    noise = float(use.sum())
    left = float(((z - taken) ** 2).sum()) - noise
    total = float((z**2).sum()) - noise
    return float(np.clip(1 - left / max(total, 1e-9), 0.0, 1.0))


def _follows(x: Experience, residual: Array, part: Part) -> tuple[str, float]:
    """The simplest thing that the residual follows, and the correlation."""
    known = np.isfinite(residual)
    if part.kind == "offset" or part.window is not None or known.sum() < 3:
        return "the position itself", np.nan
    found = {}
    for name, course in courses(x, part).items():
        spread = course[known].std()
        if spread > 1e-9:
            found[name] = float(np.corrcoef(course[known], residual[known])[0, 1])
    best = max(found, key=lambda n: abs(found[n]), default=part.kind)
    return best, found.get(best, np.nan)


def courses(x: Experience, part: Part) -> Mapping[str, Array]:
    """What a residual could follow, by name."""
    if part.kind == "force and time":
        force, t = x.f[:, part.channel % 3], x.since_start
        return {f"force*time^{k}": force * t**k for k in (1, 2, 3)}
    if part.kind.endswith("time"):
        t = x.since_start
        return {"time": t, "time^2": t**2, "time^3": t**3} | _waves(t)
    if part.kind == "temperature":
        return {"temperature": x.warming, "temperature^2": x.warming**2}
    if part.kind == "since turn":
        since = np.maximum(x.since_turn, 0.1)
        return {"time since the turn": since, "log(time since the turn)": np.log(since)}
    if part.kind == "force":
        names = [f"f_{a}" for a in "xyz"]
        forces = dict(zip(names, x.f.T, strict=True))
        return {f"{n}^{k}": f**k for n, f in forces.items() for k in (1, 2, 3, 4)}
    one, two = _of_angle("alpha", x.alpha), _of_angle("beta", x.beta)
    if part.kind == "joints":
        return {f"{a}*{b}": one[a] * two[b] for a in one for b in two}
    return one if part.kind == "alpha" else two


def _of_angle(name: str, angle: Array) -> dict[str, Array]:
    out = {name: angle}
    for k in (1, 2, 3, 4):
        inner = f"{k}*{name}" if k > 1 else name
        out[f"sin({inner})"] = np.sin(k * angle)
        out[f"cos({inner})"] = np.cos(k * angle)
    return out


def _waves(t: Array) -> dict[str, Array]:
    span = float(np.ptp(t))
    out = {}
    for cycles in np.arange(1.0, 12.01, 0.25):
        for name, wave in (("sin", np.sin), ("cos", np.cos)):
            out[f"{name}(2*pi*time/{span / cycles:.3g} s)"] = wave(
                2 * np.pi * cycles * t / span
            )
    return out


def matters(found: Sequence[Unknown], explained: float) -> bool:
    """Whether what is unknown is more than a small rest of what is explained."""
    return sum(u.squares for u in found) > SMALL * explained


def listed(positions: Sequence[int], most: int | None = None) -> str:
    """Name positions, up to so many.

    >>> listed([4]), listed([1, 2, 3], most=2)
    ('position 4', 'positions 1, 2…')
    """
    word = "position" if len(positions) == 1 else "positions"
    some = ", ".join(map(str, positions[:most]))
    return f"{word} {some}" + "…" * (most is not None and len(positions) > most)
