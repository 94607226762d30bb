"""Disturbances of a device at rest, found in cells of half a second and bridged.

A cell is disturbed where its scatter, or how its mean departs from its neighbours', is
beyond what the other cells of the same minutes have: with a robust z of 6 in the cube
root of the variance (nearly normal, Wilson and Hilferty 1931) or in the bend of the
means. What is disturbed is replaced by a line between its sides with the noise of what
goes before, mirrored; where it lasts long, or the level behind it is another, the
recording parts there.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fieldcal.core.chances import DEVIATION
from fieldcal.core.samples import Array, Index
from fieldcal.noise.likelihood import Flags

CELL = 0.5
"""Length of a cell, s."""

FEWEST = 8
"""Samples that a cell has at least."""

ODD = 6.0
"""Robust z beyond which a cell is disturbed: one in a thousand million by chance."""

MOST = 0.5
"""Where a greater part is disturbed it is no disturbance, but how the device is."""

LONGEST = 10.0
"""Disturbances that last longer part a recording, s."""

SIDE = 16
"""Cells on each side from which a disturbance is bridged."""

ENOUGH = 20
"""Cells in which a disturbance can be told from the rest."""


class Calm(NamedTuple):
    """A stretch of samples without disturbances.

    Attributes
    ----------
    rows : (n, c) samples, disturbances bridged
    begins : whether it begins a new stretch
    bridged : samples that were replaced

    """

    rows: Array
    begins: bool
    bridged: int


def calmed(rows: Array, dt: float, noisy: int) -> list[Calm]:
    """Bridge what is disturbed, or part the samples there.

    Parameters
    ----------
    rows : (n, c) samples, some minutes of them
    dt : s between samples
    noisy : columns that are channels

    """
    size = max(FEWEST, round(CELL / dt))
    cells = len(rows) // size
    if cells < ENOUGH:
        return [Calm(rows, False, 0)]
    some = rows[: cells * size, :noisy].reshape(cells, size, noisy)
    means = np.einsum("nsc->nc", some) / size
    off = some - means[:, None]
    squares = np.einsum("nsc,nsc->nc", off, off)
    bends = np.zeros_like(means)
    bends[1:-1] = np.diff(means, 2, axis=0)
    scale = _scale(bends)
    odd = (np.abs(bends) > ODD * scale).any(axis=1)
    odd |= (_z(np.cbrt(squares)) > ODD).any(axis=1)
    odd = _spread(odd)
    if not odd.any() or odd.mean() > MOST:
        return [Calm(rows, False, 0)]
    return _parted(rows, odd, size, dt, scale)


def _z(values: Array) -> Array:
    about = values - np.median(values, axis=0)
    z: Array = about / _scale(about)
    return z


def _scale(values: Array) -> Array:
    """Robust standard deviation of each column about 0; inf where most are alike."""
    usual = DEVIATION * np.median(np.abs(values), axis=0)
    scale: Array = np.where(usual > 0, usual, np.inf)
    return scale


def _spread(odd: Flags) -> Flags:
    """With the cell before and behind each."""
    out = odd.copy()
    out[1:] |= odd[:-1]
    out[:-1] |= odd[1:]
    return out


def _parted(rows: Array, odd: Flags, size: int, dt: float, scale: Array) -> list[Calm]:
    edges = np.flatnonzero(np.diff(np.r_[False, odd, False].astype(int)))
    out, whole, begun, bridged, parts = [], rows.copy(), 0, 0, False
    good = np.repeat(~odd, size)
    good = np.concatenate([good, np.ones(len(rows) - len(good), dtype=bool)])
    for first, end in (edges.reshape(-1, 2) * size).tolist():
        before = whole[max(begun, first - SIDE * size) : first]
        side = slice(end, end + SIDE * size)
        behind = whole[side][good[side]]
        if (end - first) * dt > LONGEST or _another(before, behind, scale, size):
            out.append(Calm(whole[begun:first], parts, bridged))
            begun, bridged, parts = end, 0, True
            continue
        whole[first:end] = _bridge(before, behind, end - first)
        bridged += end - first
    return [*out, Calm(whole[begun:], parts, bridged)]


def _another(before: Array, behind: Array, scale: Array, size: int) -> bool:
    """Whether the level behind a disturbance is another than before it."""
    if len(before) < size or len(behind) < size:
        return False
    step = np.abs(behind.mean(axis=0) - before.mean(axis=0))[: len(scale)]
    return bool((step > ODD * scale).any())


def _bridge(before: Array, behind: Array, length: int) -> Array:
    """Samples in the place of `length` disturbed ones."""
    source = before if len(before) >= len(behind) else behind
    ends = [(side if len(side) else source).mean(axis=0) for side in (before, behind)]
    noise = source - source.mean(axis=0)
    back: Index = len(source) - 1 - np.arange(length) % len(source)
    share = (np.arange(length) + 0.5)[:, None] / length
    bridge: Array = ends[0] + share * (ends[1] - ends[0]) + noise[back]
    return bridge
