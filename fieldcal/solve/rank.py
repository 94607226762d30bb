"""Parameters that a design determines, and positions that determine the others.

Columns are scaled to length one, so that the rank does not depend on units; directions
whose singular value is below `tolerances.UNDETERMINED` of the largest are not
determined, nor is a parameter with a component along one. Source: G. H. Golub and C. F.
Van Loan, Matrix Computations, 5.5.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from fieldcal.core.positions import Position
from fieldcal.core.samples import Array, Mask
from fieldcal.model import thresholds, tolerances
from fieldcal.model.causes.planned import design_matrix
from fieldcal.solve.observations import Observations

PROPOSED_POSITIONS = tuple(
    Position.deg(a, b)
    for a, b in [(45, 5), (-45, 5), (45, -5), (45, 0), (0, 5), (22.5, 2.5), (90, 0),
                 (0, 90), (180, 0), (45, 45)]
)  # fmt: skip
"""Positions that can be proposed: first within a small ladder, then beyond it."""


def determined_parameters(rows: Array) -> tuple[Mask, int]:
    """Which parameters (p,) a design (m, p) determines, and its rank."""
    scale = np.linalg.norm(rows, axis=0)
    # sin(180°) is not quite zero: such a column contains only rounding errors
    scale = np.where(
        scale > tolerances.ROUNDING * scale.max(initial=0.0), scale, np.inf
    )
    _, s, vt = np.linalg.svd(rows / scale, full_matrices=True)
    rank = int(
        (s > tolerances.UNDETERMINED * max(float(s.max(initial=0.0)), 1e-300)).sum()
    )
    known: Mask = (np.abs(vt[rank:]) < thresholds.MIN_NULL_SHARE).all(axis=0)
    return known, rank


def positions_to_add(
    rows: Callable[[Sequence[Position]], Array],
    taken: Sequence[Position],
    candidates: Sequence[Position],
) -> list[Position]:
    """Further positions that would determine everything, fewest first.

    Parameters
    ----------
    rows : design of positions, (n, c, p)
    taken : the positions there are
    candidates : positions that could be added

    """
    extra: list[Position] = []

    def count(places: Sequence[Position]) -> tuple[int, int]:
        table = rows(places)
        known, rank = determined_parameters(table.reshape(-1, table.shape[-1]))
        return int(known.sum()), rank  # ties go to what raises the rank

    everything = rows(taken).shape[-1]
    have = count(taken)
    while have[0] < everything:
        if len(extra) == thresholds.MAX_PROPOSED_POSITIONS:
            return []
        ranks = [count([*taken, *extra, c]) for c in candidates]
        best = max(range(len(ranks)), key=ranks.__getitem__)
        if ranks[best] <= have:
            return []
        have, extra = ranks[best], [*extra, candidates[best]]
    return extra


def ladder_remedy(observations: Observations, names: Sequence[str]) -> list[str]:
    """Names of the fewest proposed positions that would determine parameters.

    Positions without angles are ignored: they are not linear in the parameters.
    """
    known = [p for p in observations.positions if p.oriented]

    def rows(places: Sequence[Position]) -> Array:
        return design_matrix(names, places, observations.gravity, observations.mounting)

    return [p.name for p in positions_to_add(rows, known, PROPOSED_POSITIONS)]
