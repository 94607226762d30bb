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

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.diagnosis.fit import Bench, Fit
from fieldcal.diagnosis.whiten import SMOOTH, Errors, Part, factor
from fieldcal.samples import CHANNELS, Array

VARIANCE = 2.0
"""What a variance to be estimated costs, ln."""

FEWEST = 4
"""Windows from which their scatter can be told."""

TRIADS = (("acc", (0, 1, 2)), ("gyr", (3, 4, 5)))


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
    spans = [span(fit.jacobian[bench.rows.used[:, c], c]) for c in range(6)]
    for triad, channels in TRIADS:
        for kind in ("walk", "offset"):
            if kind == "offset" and bench.windows < FEWEST:
                continue
            if not any((kind, c) in there for c in channels):
                yield _of(bench, fit, spans, kind, triad, channels)
    for c, name in enumerate(CHANNELS):
        for kind in SMOOTH:
            if (kind, c) not in there and _known(bench, kind):
                yield _of(bench, fit, spans, kind, name, (c,))
    if bench.rows.x.oriented.all() and bench.errors.setting == 0:
        yield _of_angles(bench, fit)


def dropped(errors: Errors, name: str) -> Errors:
    """The errors without a part by its name."""
    if name == "setting":
        return replace(errors, setting=0.0)
    kind, _, label = name.partition(":")
    channels = dict(TRIADS).get(label) or (CHANNELS.index(label),)
    return errors.but(tuple(Part(kind, c, 0.0) for c in channels))


def size_sigma(bench: Bench, fit: Fit, kind: str, channel: int, size: float) -> float:
    """Standard uncertainty of a part's v, from the information on ln v.

    `bench` has white noise only; `fit` says what the model leaves free. The information
    is 2 sum_i (v^2 s_i^2 / (1 + v^2 s_i^2))^2.
    """
    names = [not n.startswith("aside") for n in fit.names]
    if kind == "setting":
        free = bench.whiten(fit.design)[:, :, names].reshape(-1, int(sum(names)))
        white = bench.whiten(bench.aside(fit.state)).reshape(len(free), -1)
    else:
        use = bench.rows.used[:, channel]
        free = bench.whiten(fit.design)[use, channel][:, names]
        white = factor(kind, bench.rows.x, channel)[use]
        white = white / bench.rows.sd[use, channel][:, None]
    basis = span(free)
    s = np.linalg.svd(white - basis @ (basis.T @ white), compute_uv=False)
    load = size**2 * s**2
    information = 2 * float(((load / (1 + load)) ** 2).sum())
    return size / float(np.sqrt(max(information, 1e-12)))


def _known(bench: Bench, kind: str) -> bool:
    x = bench.rows.x
    if kind in ("alpha", "beta", "joints"):
        return bool(x.oriented.all()) and bench.windows >= FEWEST
    if kind == "temperature":
        return bool(np.isfinite(x.warming).all())
    return kind != "force" or bench.windows >= FEWEST


def _of(
    bench: Bench,
    fit: Fit,
    spans: list[Array],
    kind: str,
    label: str,
    channels: tuple[int, ...],
) -> Wander:
    found, gain = [], 0.0
    for c in channels:
        use = bench.rows.used[:, c]
        if use.sum() < 8:
            continue
        f = factor(kind, bench.rows.x, c)
        deep = np.zeros((len(use), 6, f.shape[1]))
        deep[:, c] = f
        white = bench.whiten(deep)[use, c]
        size, more = raised(white, spans[c], fit.white[use, c])
        if more > VARIANCE:
            found.append(Part(kind, c, size))
            gain += more - VARIANCE
    return Wander(f"{kind}:{label}", gain, bench.errors.but(tuple(found)))


def _of_angles(bench: Bench, fit: Fit) -> Wander:
    turned = bench.whiten(bench.aside(fit.state))
    flat = fit.jacobian.reshape(-1, len(fit.names))
    size, more = raised(turned.reshape(len(flat), -1), span(flat), fit.white.ravel())
    return Wander("setting", more - VARIANCE, replace(bench.errors, setting=size))


def span(jacobian: Array) -> Array:
    """Orthonormal basis of what a model leaves free, (r, k)."""
    norm = np.linalg.norm(jacobian, axis=0)
    keep = norm > 0
    basis, size, _ = np.linalg.svd(jacobian[:, keep] / norm[keep], full_matrices=False)
    out: Array = basis[:, size > 1e-9 * size.max(initial=0.0)]
    return out


def raised(factor: Array, basis: Array, white: Array) -> tuple[float, float]:
    """Size v at the highest likelihood, and by how much that is higher.

    Parameters
    ----------
    factor : (r, m) F, whitened
    basis : (r, k) orthonormal, of what the model leaves free
    white : (r,) residual, whitened

    """
    left = factor - basis @ (basis.T @ factor)
    r = white - basis @ (basis.T @ white)
    a, s, _ = np.linalg.svd(left, full_matrices=False)
    seen = s > 1e-6 * np.linalg.norm(factor, axis=0).max(initial=1e-300)
    power, strength = (a.T @ r)[seen] ** 2, s[seen] ** 2
    if not seen.any():
        return 0.0, 0.0
    top = 10.0 * np.sqrt(power.max() + 1.0) / np.sqrt(strength.max())
    sizes = top * np.geomspace(1.0, 1e-4, 120)
    load = sizes[:, None] ** 2 * strength
    gain = 0.5 * np.sum(power * load / (1 + load) - np.log1p(load), axis=1)
    best = int(np.argmax(gain))
    return (float(sizes[best]), float(gain[best])) if gain[best] > 0 else (0.0, 0.0)
