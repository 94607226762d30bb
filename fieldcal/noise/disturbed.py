"""Disturbances of a device at rest, found in cells of half a second and bridged.

A cell is disturbed if its scatter, or the second difference of its mean, is beyond that
of the other cells of the same minutes: a robust z of 6 in the cube root of the variance
(nearly normal, Wilson and Hilferty 1931) or in the second difference. Disturbed samples
are replaced by a line between both sides with the mirrored noise from before. If the
disturbance lasts long, or if the level changes, the recording is split there.

Samples come in pieces. What lies near the end of a piece is left for the next one, so
that every disturbance is seen whole, with both of its sides.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fieldcal.core.probability import MAD_TO_SIGMA
from fieldcal.core.samples import Array, Index, runs_of_true
from fieldcal.noise.likelihood import Flags

CELL = 0.5
"""Length of a cell, s."""

MIN_CELL_SAMPLES = 8
"""Fewest samples of a cell."""

ODD = 6.0
"""Robust z beyond which a cell is disturbed: one in a thousand million by chance."""

MAX_DISTURBED_SHARE = 0.5
"""Largest disturbed part; more of it is the normal behaviour of the device."""

MAX_BRIDGED_S = 10.0
"""Longest disturbance that is bridged, s; a longer one splits the recording."""

CELLS_BESIDE = 16
"""Cells on each side from which a disturbance is bridged."""

MIN_CELLS = 20
"""Fewest cells in which disturbances are looked for, and that are left for the next
piece: more than `CELLS_BESIDE` and the neighbours of a cell."""

CELLS_OF_PIECE = 100
"""Fewest cells of a piece that is not the last one: half of them, which may be one
disturbance, and its sides."""


class CalmStretch(NamedTuple):
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


def bridge_disturbances(
    rows: Array, dt: float, noisy: int, last: bool
) -> tuple[list[CalmStretch], Array]:
    """Bridge disturbances, or split the samples there.

    Parameters
    ----------
    rows : (n, c) samples, some minutes of them
    dt : s between samples
    noisy : columns that are channels
    last : whether no samples follow

    Returns
    -------
    calm stretches, and the samples to be given again before those that follow

    """
    size = max(MIN_CELL_SAMPLES, round(CELL / dt))
    cells = len(rows) // size
    if not last and cells < CELLS_OF_PIECE:
        return [], rows
    if cells < MIN_CELLS:
        return [CalmStretch(rows, False, 0)], rows[:0]
    odd, scale = _disturbed_cells(rows, size, noisy)
    end = len(rows) if last else _first_left(odd) * size
    if not odd[: end // size].any():
        return [CalmStretch(rows[:end], False, 0)], rows[end:]
    odd = odd[: end // size]
    return _split_and_bridge(rows[:end], odd, size, dt, scale), rows[end:]


def _first_left(odd: Flags) -> int:
    """Index of the first cell that is left for the next piece.

    It is calm, and so are those of the side of a disturbance that is not seen whole.
    """
    left = len(odd) - MIN_CELLS
    for first, end in runs_of_true(odd)[::-1].tolist():
        if end + CELLS_BESIDE > left:
            left = min(left, first - CELLS_BESIDE)
    return max(left, 0)


def _disturbed_cells(rows: Array, size: int, noisy: int) -> tuple[Flags, Array]:
    """Disturbed cells, and the robust sigma of the second differences of means.

    No cell is disturbed where most are: that is how the device behaves.
    """
    cells = len(rows) // size
    some = rows[: cells * size, :noisy].reshape(cells, size, noisy)
    means = np.einsum("nsc->nc", some) / size
    off = some - means[:, None]
    squares = np.einsum("nsc,nsc->nc", off, off)
    bends = np.zeros_like(means)
    bends[1:-1] = np.diff(means, 2, axis=0)
    scale = _robust_sigma(bends)
    odd = (np.abs(bends) > ODD * scale).any(axis=1)
    odd |= (_robust_z(np.cbrt(squares)) > ODD).any(axis=1)
    odd = _with_neighbours(odd)
    if odd.mean() > MAX_DISTURBED_SHARE:
        odd[:] = False
    return odd, scale


def _robust_z(values: Array) -> Array:
    about = values - np.median(values, axis=0)
    z: Array = about / _robust_sigma(about)
    return z


def _robust_sigma(values: Array) -> Array:
    """Robust standard deviation of each column about 0; inf where most are alike."""
    usual = MAD_TO_SIGMA * np.median(np.abs(values), axis=0)
    scale: Array = np.where(usual > 0, usual, np.inf)
    return scale


def _with_neighbours(odd: Flags) -> Flags:
    """Extend flagged cells by the cell before and after each."""
    out = odd.copy()
    out[1:] |= odd[:-1]
    out[:-1] |= odd[1:]
    return out


def _split_and_bridge(
    rows: Array, odd: Flags, size: int, dt: float, scale: Array
) -> list[CalmStretch]:
    out, whole, begun, bridged, parts = [], rows.copy(), 0, 0, False
    good = np.repeat(~odd, size)
    good = np.concatenate([good, np.ones(len(rows) - len(good), dtype=bool)])
    for first, end in (runs_of_true(odd) * size).tolist():
        before = whole[max(begun, first - CELLS_BESIDE * size) : first]
        side = slice(end, end + CELLS_BESIDE * size)
        behind = whole[side][good[side]]
        if (end - first) * dt > MAX_BRIDGED_S or _level_changed(
            before, behind, scale, size
        ):
            out.append(CalmStretch(whole[begun:first], parts, bridged))
            begun, bridged, parts = end, 0, True
            continue
        whole[first:end] = _bridge(before, behind, end - first)
        bridged += end - first
    return [*out, CalmStretch(whole[begun:], parts, bridged)]


def _level_changed(before: Array, behind: Array, scale: Array, size: int) -> bool:
    """Whether the level after a disturbance differs from that before it."""
    if len(before) < size or len(behind) < size:
        return False
    step = np.abs(behind.mean(axis=0) - before.mean(axis=0))[: len(scale)]
    return bool((step > ODD * scale).any())


def _bridge(before: Array, behind: Array, length: int) -> Array:
    """Samples that replace `length` disturbed ones."""
    source = before if len(before) >= len(behind) else behind
    ends = [(side if len(side) else source).mean(axis=0) for side in (before, behind)]
    noise = source - source.mean(axis=0)
    back: Index = len(source) - 1 - np.arange(length) % len(source)
    share = (np.arange(length) + 0.5)[:, None] / length
    bridge: Array = ends[0] + share * (ends[1] - ends[0]) + noise[back]
    return bridge
