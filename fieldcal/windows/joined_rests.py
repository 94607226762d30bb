"""Rests that bumps divide, joined where the device lies after a bump as before.

The bump is left out as a gap. Where samples agree with the rest before it up to some
instant and then with the rest after it, nobody touched the device: a bias jumped, and
nothing is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fieldcal.core.probability import chi2_tail
from fieldcal.core.samples import Array, Block, concat
from fieldcal.windows.cells import (
    CELL,
    CellRows,
    CellTable,
    SamplesBetween,
    fill_with_previous,
)
from fieldcal.windows.dead_axis import LiveAxisRows
from fieldcal.windows.rests import PAUSES, SPREAD_CELLS, cell_index, cell_table
from fieldcal.windows.same_attitude import probability_unmoved

LEAST_PROBABILITY = 0.99
"""Probability from which the attitude counts as unchanged; otherwise a new position
begins, and the rotation is determined by the turn between both."""

LONGEST_S = 60.0
"""Longest gap that is judged, s: the longest turn that is integrated."""

NOISE_CELLS = 6000
"""Cells on either side from which the noise is estimated: ten minutes."""

NOISE_PROBABILITY = 1e-3
"""Probability of the scatter in a gap by noise alone, below which it was disturbed."""

CELLS_BESIDE_GAP = 20
"""Cells beside a gap that predict the samples in it: two seconds."""


class RestPeriod(NamedTuple):
    """A stretch at rest, s of device time, with the gaps that are left out of it."""

    start: float
    end: float
    gaps: tuple[tuple[float, float], ...] = ()

    @property
    def pieces(self) -> list[tuple[float, float]]:
        """Start and end of each part between the gaps, in order, s."""
        starts = [self.start, *(end for _, end in self.gaps)]
        return list(zip(starts, [*(s for s, _ in self.gaps), self.end], strict=True))


def join_rests(
    rows: CellRows,
    origin: Array,
    between: SamplesBetween,
    spans: Sequence[tuple[float, float]],
) -> list[RestPeriod]:
    """Join still stretches that are divided only by bumps.

    Parameters
    ----------
    rows, origin, between : of the recording, as `still_stretches_of_file` has them
    spans : start and end of each stretch, s of device time, in order

    """
    living = LiveAxisRows(rows)
    out: list[RestPeriod] = []
    for start, end in spans:
        last = out[-1] if out else None
        gaps = last and _gaps_to_leave_out(
            living,
            origin,
            living.samples_without_dead_axes(between),
            last.pieces[-1],
            (start, end),
        )
        if last is None or gaps is None:
            out.append(RestPeriod(start, end))
        else:
            out[-1] = RestPeriod(last.start, end, (*last.gaps, *gaps))
    return out


def _gaps_to_leave_out(
    rows: CellRows,
    origin: Array,
    between: SamplesBetween,
    first: tuple[float, float],
    later: tuple[float, float],
) -> list[tuple[float, float]] | None:
    """Gaps to leave out if two stretches can be joined; None if they cannot.

    The list is empty where a bias jumped and nobody touched the device.
    """
    gap = (first[1], later[0])
    if gap[1] - gap[0] > LONGEST_S:
        return None
    began, ended, begins, ends = (cell_index(rows, t) for t in (*first, *later))
    before = cell_table(rows[max(began, ended - NOISE_CELLS) : ended], origin)
    after = cell_table(rows[begins + 1 : min(ends, begins + 1 + NOISE_CELLS)], origin)
    way = concat(list(between(gap[0] - CELL, gap[1] + CELL)))
    if min(len(before), len(after)) < 2 or _has_pause(way.t):
        return None
    if not probability_unmoved(before, way, after, gap) > LEAST_PROBABILITY:
        return None
    return [] if _is_untouched(before, way.between(*gap), after) else [gap]


def _is_untouched(before: CellTable, way: Block, after: CellTable) -> bool:
    """Whether samples agree with `before` up to some instant, and then with `after`."""
    noise = fill_with_previous(
        np.vstack([before.short_lag_variance, after.short_lag_variance])
    ).mean(axis=0)
    noise = noise + np.maximum(before.rounding, after.rounding) ** 2
    last_level = before.origin + fill_with_previous(before.means)[
        -CELLS_BESIDE_GAP:
    ].mean(axis=0)
    next_level = after.origin + fill_with_previous(after.means)[:CELLS_BESIDE_GAP].mean(
        axis=0
    )
    known = np.isfinite(last_level + next_level + noise) & (noise > 0)
    six = way.six[:, known]
    if not np.isfinite(six).all():
        return False
    early, late = (np.cumsum((np.square(six - level[known]) / noise[known]).sum(axis=1))
                   for level in (last_level, next_level))  # fmt: skip
    early, late = np.append(0.0, early), np.append(0.0, late)
    least = float((early + late[-1] - late).min())
    return chi2_tail(least, six.size) > NOISE_PROBABILITY


def _has_pause(t: Array) -> bool:
    """Whether the recording paused between these instants, s."""
    step = np.diff(t)
    if not len(step):
        return True
    return bool(step.max() > max(SPREAD_CELLS * CELL, PAUSES * float(np.median(step))))
