"""What is random, or a function of something that no effect in the catalogue makes.

The rows' errors may have, beyond white noise, a part F u with u ~ N(0, v^2 I). With P
the projection on what the model leaves free and s_i, a_i the singular values and left
vectors of P F (all whitened), the restricted likelihood rises by

    ln L(v) - ln L(0) = 1/2 sum_i [ r_i^2 v^2 s_i^2 / (1 + v^2 s_i^2)
                                    - ln(1 + v^2 s_i^2) ],    r_i = a_i^T r

r being the whitened residual. Source: Searle, Casella, McCulloch, Variance Components,
chapter 6 (restricted maximum likelihood).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.diagnosis.bench import Bench
from fieldcal.diagnosis.fit import Fit
from fieldcal.diagnosis.whiten import SMOOTH, Errors, Part, factor, kind_of
from fieldcal.samples import CHANNELS, Array

VARIANCE = 2.0
"""What a variance to be estimated costs, ln."""

UNKNOWN = 6.0
"""What a function costs that no effect makes, ln: known causes come first."""

USUAL = {"walk": (3e-3, 3e-4), "offset": (2e-2, 1e-3)}
"""Sizes of what wanders that nobody wonders at: m/s^2 (/sqrt(s)), rad/s (/sqrt(s))."""

LONE = 3.0
"""What it costs, ln, that of three axes alike only one should wander."""

COMPARABLE = 0.15
"""Part of the largest that one of axes alike wanders by at least."""

WHICH = 2.5
"""What it costs, ln, to choose one window of a dozen."""

ROUNDED = 1e-10
"""Part of a column's squares that arithmetic may leave of nothing."""

FEW_ROWS = 8
"""Rows of a channel below which nothing random is looked for in it."""

FEWEST = 4
"""Windows from which their scatter can be told."""

TRIADS = (("acc", (0, 1, 2)), ("gyr", (3, 4, 5)))

Projected = Mapping[int, tuple[Array, Array]]
"""F^T P F and F^T P r of a part, by channel."""


@dataclass(frozen=True, slots=True)
class Wander:
    """How much a random part would raise the likelihood.

    Attributes
    ----------
    name : "walk:acc", "offset:gyr", "alpha:ax", "setting" ...
    gain : ln L, paid for the variances
    errors : the errors with it

    """

    name: str
    gain: float
    errors: Errors


def wanders(bench: Bench, fit: Fit) -> Iterator[Wander]:
    """Every part that is not there yet, with its gain."""
    there = {(p.kind, p.channel) for p in bench.errors.parts}
    for triad, channels in TRIADS:
        if not any(("walk", c) in there for c in channels):
            yield _wander(bench, "walk", triad, _seen(bench, fit, "walk", channels))
        if bench.windows < FEWEST:
            continue
        each = _seen(bench, fit, "offset", channels)
        if not any(("offset", c) in there for c in channels):
            yield _wander(bench, "offset", triad, each)
        window = _odd_one(each)
        kind = kind_of(int(np.unique(bench.rows.x.position)[window]))
        if not any((kind, c) in there for c in channels):
            only = {c: _part(of, window) for c, of in each.items()}
            yield _wander(bench, kind, triad, only)
    for c, name in enumerate(CHANNELS):
        for kind in SMOOTH:
            if (kind, c) not in there and _known(bench, kind):
                yield _wander(bench, kind, name, _seen(bench, fit, kind, (c,)))
    if bench.rows.x.oriented.all() and bench.errors.setting == 0:
        yield _of_angles(bench, fit)


def alone(bench: Bench, fit: Fit, window: int) -> Wander:
    """The part of one window that the accelerometers have."""
    triad, channels = TRIADS[0]
    kind = kind_of(window)
    return _wander(bench, kind, triad, _seen(bench, fit, kind, channels))


def cautious(bench: Bench, fit: Fit) -> Errors:
    """The errors with whatever scatter of the windows there may be, proved or not.

    Numbers that are reported are the more honest for it: an instability too small to be
    named still moves the means.
    """
    errors = bench.errors
    if bench.windows < FEWEST:
        return errors
    there = {p.channel for p in errors.parts if p.window is None}
    parts = []
    for c in np.flatnonzero(bench.rows.used.any(axis=0)):
        if c not in there:
            white = bench.whiten.channel(factor("offset", bench.rows.x, int(c)), int(c))
            size, _ = raised(*projected_channel(fit, white, int(c)))
            parts.append(Part("offset", int(c), size))
    return errors.but(tuple(parts))


def dropped(errors: Errors, name: str) -> Errors:
    """The errors without a part by its name."""
    if name == "setting":
        return replace(errors, setting=0.0)
    kind, _, label = name.partition(":")
    channels = dict(TRIADS).get(label) or (CHANNELS.index(label),)
    return errors.but(tuple(Part(kind, c, 0.0) for c in channels))


def size_sigma(bench: Bench, fit: Fit, kind: str, channel: int, size: float) -> float:
    """Standard uncertainty of a part's v, from the information on ln v.

    `bench` has white noise only; `fit` says which effects are in the model. The
    information is 2 sum_i (v^2 s_i^2 / (1 + v^2 s_i^2))^2.
    """
    if kind == "setting":
        columns = bench.aside(fit.state)
    else:
        wide = factor(kind, bench.rows.x, channel)
        columns = np.zeros((*bench.rows.y.shape, wide.shape[1]))
        columns[:, channel] = wide
    there = bench.fit(fit.terms, fit)
    strength = np.linalg.eigvalsh(projected(there, bench.whiten(columns))[0])
    load = size**2 * np.maximum(strength, 0.0)
    information = 2 * float(((load / (1 + load)) ** 2).sum())
    return size / float(np.sqrt(max(information, 1e-12)))


def _known(bench: Bench, kind: str) -> bool:
    x = bench.rows.x
    if kind in ("alpha", "beta", "joints"):
        return bool(x.oriented.all()) and bench.windows >= FEWEST
    if kind == "temperature":
        return bool(np.isfinite(x.warming).all())
    return not kind.startswith("force") or bench.windows >= FEWEST


def _seen(bench: Bench, fit: Fit, kind: str, channels: Sequence[int]) -> Projected:
    """What the rows say of a part on each of some channels, if they are enough."""
    out = {}
    for c in channels:
        if bench.rows.used[:, c].sum() >= FEW_ROWS:
            white = bench.whiten.channel(factor(kind, bench.rows.x, c), c)
            out[c] = projected_channel(fit, white, c)
    return out


def _odd_one(each: Projected) -> int:
    """Index of the window that is off the most, of what is said of offsets."""
    off = np.zeros(1)
    for information, pull in each.values():
        strength = np.diag(information)
        off = off + np.where(strength > 0, pull**2 / np.maximum(strength, 1e-300), 0.0)
    return int(np.argmax(off))


def _part(of: tuple[Array, Array], column: int) -> tuple[Array, Array]:
    """The same of one column alone."""
    some = slice(column, column + 1)
    return of[0][some, some], of[1][some]


def _wander(bench: Bench, kind: str, label: str, seen: Projected) -> Wander:
    found, gain = [], 0.0
    for c, of in seen.items():
        size, more = raised(*of)
        if more > VARIANCE:
            found.append(Part(kind, c, size))
            gain += more
    errors = bench.errors.but(tuple(found))
    gain -= fees(errors) - fees(bench.errors)
    return Wander(f"{kind}:{label}", gain, errors)


def fees(errors: Errors) -> float:
    """What the random parts cost, ln: variances, and more where no cause is known."""
    total = VARIANCE * (len(errors.parts) + (errors.setting > 0))
    for first in (0, 3):
        parts = [p for p in errors.parts if first <= p.channel < first + 3]
        total += UNKNOWN * sum(p.kind in SMOOTH for p in parts)
        total += (UNKNOWN + WHICH) * len({p.window for p in parts} - {None})
        total += UNKNOWN * (len(alike([p for p in parts if p.kind == "offset"])) == 1)
        total += LONE * (sum(p.kind == "walk" for p in parts) == 1)
        total += sum(_wonder(p) for p in parts)
    return float(total)


def alike(parts: Sequence[Part]) -> list[Part]:
    """Those of about the size of the largest; what is far smaller goes with it."""
    largest = max((p.size for p in parts), default=0.0)
    return [p for p in parts if p.size >= COMPARABLE * largest]


def _wonder(part: Part) -> float:
    """What a size costs that no device wanders by, ln."""
    if part.kind not in USUAL:
        return 0.0
    return 2 * float(np.log1p((part.size / USUAL[part.kind][part.channel // 3]) ** 2))


def _of_angles(bench: Bench, fit: Fit) -> Wander:
    turned = bench.whiten(bench.aside(fit.state))
    size, more = raised(*projected(fit, turned))
    return Wander("setting", more - VARIANCE, replace(bench.errors, setting=size))


def raised(information: Array, pull: Array) -> tuple[float, float]:
    """Size v at the highest likelihood, and by how much that is higher.

    Parameters
    ----------
    information : (m, m) F^T P F
    pull : (m,) F^T P r

    """
    strength, a = np.linalg.eigh(information)
    seen = strength > 1e-10 * max(float(strength.max()), 1e-300)
    strength, power = strength[seen], (a.T @ pull)[seen] ** 2
    if not seen.any():
        return 0.0, 0.0
    power = power / strength
    top = 10.0 * np.sqrt(power.max() + 1.0) / np.sqrt(strength.max())
    sizes = top * np.geomspace(1.0, 1e-4, 120)
    load = sizes[:, None] ** 2 * strength
    gain = 0.5 * np.sum(power * load / (1 + load) - np.log1p(load), axis=1)
    best = int(np.argmax(gain))
    return (float(sizes[best]), float(gain[best])) if gain[best] > 0 else (0.0, 0.0)


def projected(fit: Fit, columns: Array) -> tuple[Array, Array]:
    """F^T P F and F^T P r for whitened columns F, (n, 6, m), of a fit's rows."""
    flat = columns.reshape(-1, columns.shape[2])
    free = fit.jacobian.reshape(len(flat), -1)
    shared = free.T @ flat
    information = flat.T @ flat - shared.T @ fit.covariance @ shared
    white = fit.white.ravel()
    pull = flat.T @ white - shared.T @ (fit.covariance @ (free.T @ white))
    return _told(information, pull, flat)


def projected_channel(fit: Fit, columns: Array, channel: int) -> tuple[Array, Array]:
    """The same for columns (n, m) of one channel."""
    free = fit.jacobian[:, channel]
    shared = free.T @ columns
    information = columns.T @ columns - shared.T @ fit.covariance @ shared
    flat = fit.jacobian.reshape(-1, free.shape[1])
    kept = fit.covariance @ (flat.T @ fit.white.ravel())
    pull = columns.T @ fit.white[:, channel] - shared.T @ kept
    return _told(information, pull, columns)


def _told(information: Array, pull: Array, columns: Array) -> tuple[Array, Array]:
    """Both, with zeros where projecting leaves of a column what is rounded only."""
    rounded = np.diag(information) < ROUNDED * (columns**2).sum(axis=0)
    information = np.where(rounded | rounded[:, None], 0.0, information)
    return (information + information.T) / 2, np.where(rounded, 0.0, pull)
