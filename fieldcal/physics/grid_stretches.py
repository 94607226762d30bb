"""Finds where the grid that an output lies on changes amid a recording.

A device that changes its range, or a program that writes fewer digits from some line
on, leaves a stretch in which an output lies on the multiples of a step q, k q + c,
beside stretches in which it does not. There of the samples that differ from the one
before a part f at most lies on that grid by chance, so a run of m of them that all do
has odds of n f^m. Such a run is a stretch with a grid of its own.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.once import once_per_block
from fieldcal.core.samples import Array, Block, runs_of_true
from fieldcal.physics.recording import (
    MIN_GRID_GAPS,
    Grids,
    grids_of,
    lsb_of,
    shown_in,
    shown_values,
    step_between,
)
from fieldcal.physics.rounded_grid import ROUNDED, grid_below_digits
from fieldcal.windows import rounding
from fieldcal.windows.noise import short_lag_noise

PIECES = (48, 12)
"""Pieces of a recording whose grids are compared: a stretch of a few percent shows, and
of few samples a longer one."""

MANY_VALUES = 0.7
"""Values of a piece, of its samples that are looked at, from which it lies on no coarse
grid: few come again."""

FEW_VALUES = 0.1
"""Values of a rest on a coarse grid, of its samples, at most: two or three in turn."""

COARSER = 1.9
"""Steps of the recording in a step of a coarser stretch, at least."""

ON_GRID, UNSURE = 0.06, 0.2
"""Largest distance from a grid, in steps, and that from which the place of a value on
it is unknown, far from those that showed it."""

ODDS = 1e-9
"""Odds by which a stretch on a coarser grid may be a matter of chance."""

USUAL = 0.75
"""Part of the samples beside a stretch that may lie on its grid: where all do, there is
no change."""


Stretch = tuple[int, int, float]
"""First and one past the last sample of a stretch on one grid, and its step."""


@once_per_block
def grids_by_stretch(block: Block) -> Grids:
    """Grids of the outputs of a recording, a stretch for each."""
    whole = _without_digits(block, grids_of(block))
    parts = [
        _with_those_of_other_axes(triad, steps)
        for triad, steps in ((block.acc, whole[:3]), (block.gyr, whole[3:]))
    ]
    found = [stretches for triad in parts for stretches in triad]
    if not any(found):
        return Grids(np.zeros(1, dtype=np.intp), whole[None])
    starts = np.unique([0, *(i for one in found for a, b, _ in one for i in (a, b))])
    starts = starts[starts < len(block)].astype(np.intp)
    steps = np.tile(whole, (len(starts), 1))
    for c, stretches in enumerate(found):
        triad = block.acc if c < 3 else block.gyr
        beside = _step_beside(triad[:, c % 3], stretches)
        others = [s for s in stretches if not _alike(s[2], beside)]
        if others:
            steps[:, c] = beside
        for a, b, step in others:
            steps[(starts >= a) & (starts < b), c] = step
    return Grids(starts, steps)


def _without_digits(block: Block, steps: Array) -> Array:
    """Steps of the device (6,), where those of the digits of a log hide them.

    An axis that shows too few values has the step of its sensor's other axes.
    """
    out = steps.copy()
    for first, triad in ((0, block.acc), (3, block.gyr)):
        shown = [shown_values(axis) for axis in triad.T]
        own = np.array([grid_below_digits(v, q) for v, q in
                        zip(shown, steps[first : first + 3], strict=True)])  # fmt: skip
        for c, values in enumerate(shown):
            fits = [q for q in own if q and _is_rounded(values, q, steps[first + c])]
            out[first + c] = own[c] or min(fits, default=steps[first + c])
    return out


def _step_beside(values: Array, stretches: Sequence[Stretch]) -> float:
    """Step of the grid of what is in none of some stretches."""
    beside = np.ones(len(values), dtype=bool)
    for a, b, _ in stretches:
        beside[a:b] = False
    return lsb_of(values[beside])


def _alike(step: float, other: float) -> bool:
    """Whether two steps are one, as decimals show it."""
    return other > 0 and 1 / COARSER < step / other < COARSER


def _with_those_of_other_axes(triad: Array, whole: Array) -> list[list[Stretch]]:
    """Stretches of the axes of a sensor; an axis that shows few values has the others'.

    `triad` is (n, 3), `whole` (3,) the steps of all values.
    """
    own = [_coarser_stretches(v, q) for v, q in zip(triad.T, whole, strict=True)]
    out = []
    for values, step, stretches in zip(triad.T, whole, own, strict=True):
        more: list[Stretch] = []
        for a, b, coarse in (one for other in own for one in other):
            apart = all(b <= first or a >= last for first, last, _ in stretches + more)
            if apart and coarse > COARSER * step and _is_on_grid(values[a:b], coarse):
                more.append((a, b, coarse))
        out.append(stretches + more)
    return out


def _is_on_grid(values: Array, step: float) -> bool:
    """Whether few values are whole steps apart."""
    shown = shown_values(values)
    away = (shown - shown[:1]) / step
    return bool((np.abs(away - np.round(away)) < ON_GRID).all())


def _is_rounded(values: Array, step: float, digits: float) -> bool:
    """Whether values are multiples of a step, rounded to some digits."""
    off = np.abs(values - step * np.round(values / step))
    return bool((off <= ROUNDED * digits).all())


def _coarser_stretches(values: Array, step: float) -> list[Stretch]:
    """Stretches on coarser grids than that of all values (n,), which may be 0."""
    pieces = [piece for many in PIECES for piece in np.array_split(values, many)]
    out: list[Stretch] = []
    for coarse, phase, span in sorted(_shown_grids(pieces, step), reverse=True):
        if any(abs(coarse / q - 1) < ON_GRID for _, _, q in out):
            continue
        taken = [(a, b) for a, b, _ in out]
        out += [
            (a, b, coarse)
            for a, b in _runs_on_grid(values, coarse, phase, span).tolist()
            if all(b <= first or a >= last for first, last in taken)
        ]
    return out


def _shown_grids(
    pieces: list[Array], step: float
) -> Iterator[tuple[float, float, float]]:
    """Step, phase, and values that showed them, of grids coarser than `step`.

    The last is the distance from the phase, in steps, up to which the grid is sure.
    """
    ends = [(np.nanmin(p), np.nanmax(p)) for p in pieces if np.isfinite(p).any()]
    lowest = min((low for low, _ in ends), default=np.nan)
    highest = max((high for _, high in ends), default=np.nan)
    for piece in pieces:
        shown, known = shown_values(piece), np.isfinite(piece).sum()
        if not 1 < len(shown) < MANY_VALUES * len(piece) / shown_in(int(known)):
            continue
        few = len(shown) <= MIN_GRID_GAPS
        # some values may be grid points by chance, but do not come again and again
        if few and len(shown) > FEW_VALUES * len(piece):
            continue
        if few and shown[0] == lowest and shown[-1] == highest:
            continue  # an output that goes from one of its limits to the other
        coarse = float(np.diff(shown).min()) if few else step_between(shown)
        if not coarse or coarse < COARSER * step:
            continue
        k = np.round((shown - shown[len(shown) // 2]) / coarse)
        (coarse, phase), *_ = np.polyfit(k, shown, 1, full=True)
        off = np.abs((shown - phase) / coarse - k).max()
        if off < ON_GRID / 2:
            sure = np.ptp(k) * UNSURE / max(off, 1e-9)
            yield float(coarse), float(phase), float(sure)


def _runs_on_grid(
    values: Array, step: float, phase: float, span: float
) -> NDArray[np.intp]:
    """Runs of samples on a grid, (m, 2), beside others that are not; none if all are.

    `span` is the distance from `phase`, in steps, up to which the grid is sure.
    """
    place = (values - phase) / step
    off = np.abs(place - np.round(place)) > ON_GRID
    known = np.isfinite(values) & (np.abs(place) < span)
    off &= known
    differs = known & (np.diff(values, prepend=np.nan) != 0)
    often = 1 - (off & differs).sum() / max(differs.sum(), 1)
    if not off.any():
        return np.empty((0, 2), dtype=np.intp)
    usual = min(max(often, 0.1), USUAL)
    least = np.log(ODDS / len(values)) / np.log(usual)
    told = np.concatenate([[0], np.cumsum(differs)])
    runs = runs_of_true(~off)
    runs = _joined(runs[told[runs[:, 1]] - told[runs[:, 0]] > least], told, least)
    rest = differs.copy()
    for a, b in runs:
        rest[a:b] = False
    # a grid that most of the others lie on as well is that of all
    by_chance = (rest & ~off).sum() / max(rest.sum(), 1)
    return runs if by_chance < USUAL else runs[:0]


def _joined(
    runs: NDArray[np.intp], told: NDArray[np.intp], least: float
) -> NDArray[np.intp]:
    """Runs without the short gaps between them, which a few wrong samples make."""
    if len(runs) < 2:
        return runs
    apart = told[runs[1:, 0]] - told[runs[:-1, 1]] > least
    first = np.concatenate([[True], apart])
    last = np.concatenate([apart, [True]])
    return np.column_stack([runs[first, 0], runs[last, 1]])


def windows_on_one_grid(
    block: Block, grids: Grids, windows: NDArray[np.intp]
) -> NDArray[np.intp]:
    """Windows (p, 2) of which those amid which a grid changes are cut there.

    The rounding of two grids moves a mean by two errors, which looks like a step. The
    part is kept whose means are known best, each beside those of the other parts.
    """
    out = windows.copy()
    for row, (start, end) in enumerate(windows.tolist()):
        cuts = grids.starts[(start < grids.starts) & (grids.starts < end)].tolist()
        if cuts:
            parts = list(itertools.pairwise([start, *cuts, end]))
            noise = _largest_noise(block, parts)
            errors = np.array([_variance_of_mean(grids, noise, *one) for one in parts])
            least = np.maximum(errors.min(axis=0), 1e-300)
            out[row] = parts[int(np.argmin((errors / least).sum(axis=1)))]
    return out


def _largest_noise(block: Block, parts: Sequence[tuple[int, int]]) -> Array:
    """Noise of a sample in the part that shows most of it, (6,).

    A coarse grid hides noise, and so do few samples.
    """
    six = [np.hstack([block.acc[a:b], block.gyr[a:b]]) for a, b in parts]
    found: Array = np.max([np.nan_to_num(short_lag_noise(one)) for one in six], axis=0)
    return found


def _variance_of_mean(grids: Grids, sampled: Array, first: int, last: int) -> Array:
    """Variance of the means of samples by their noise and rounding, (6,)."""
    step = grids.within(first, last)
    by_rounding = np.maximum(
        rounding.variance_of_mean(step, sampled),
        rounding.variance_of_few_values(step, sampled),
    )
    total: Array = (sampled**2 + step**2 / 12) / (last - first) + by_rounding
    return total
