"""Columns of turns: derivatives of the closure, and of the outputs during a turn.

The closure depends on the outputs of the gyroscopes by the integral (1) of `turn`, and
on the inputs in the positions at both ends. Columns are calculated for all turns at
once, except those that need a whole turn, or that change its ends.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fieldcal.core.samples import Array, Index, Mask
from fieldcal.model.causes.basis import Course, General, RowView
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.evidence.sets import Set
from fieldcal.model.system.end_columns import EndColumns
from fieldcal.model.system.turn_force_rows import turn_force_columns
from fieldcal.model.turns.turn import Turn
from fieldcal.physics.experience_rows import concatenate_rows


class TurnColumns:
    """Columns that can change one turn, with edges `view`.

    Attributes
    ----------
    general : columns of each basis that are used during the turn, and their outputs at
        the edges, (m + 1, 6, j)

    """

    def __init__(self, turn: Turn, view: RowView) -> None:
        self.turn, self.view = turn, view
        self._weights = turn.weights(view.state.scale[3:])  # (3, m + 1, 3)
        self._columns: list[tuple[Index, Array]] = []
        self.general: list[tuple[Index, Array]] = []

    @property
    def index(self) -> Index:
        """Columns of the dictionary, (k,)."""
        return np.concatenate([index for index, _ in self._columns])

    @property
    def closing(self) -> Array:
        """Derivative of the closure by each of these columns, (3, k) rad."""
        return np.concatenate([closing for _, closing in self._columns], axis=1)

    def add_course(self, first: int, table: Array, share: Array | None = None) -> None:
        """Add a function (m + 1, j) on each gyroscope, times `share` (m + 1, 3)."""
        width = table.shape[1]
        for c in range(3):
            weight = self._weights[:, :, c] * (1.0 if share is None else share[:, c])
            index = first + (3 + c) * width + np.arange(width)
            self._columns.append((index, weight @ table))

    def add_still(self, index: Index) -> None:
        """Add columns (k,) that do not change the closure through the gyroscopes."""
        self._columns.append((index, np.zeros((3, len(index)))))

    def add_outputs(
        self,
        index: Index,
        outputs: Array,
        on_way: Mask | None,
        bent: Array | float = 0.0,
    ) -> None:
        """Add columns by their outputs, (m + 1, 6, k), and change of the ends, (3, k).

        Those `on_way` (k,) are used during the turn as well; none if None.
        """
        weights = self._weights.reshape(3, -1)  # (3, 3 (m + 1))
        rates = outputs[:, 3:].reshape(weights.shape[1], -1)
        self._columns.append((index, weights @ rates - bent))
        if on_way is not None:
            self.general.append((index[on_way], outputs[:, :, on_way]))


def columns_of_turns(
    turns: Sequence[Turn],
    views: Sequence[RowView],
    dictionary: Dictionary,
    at_ends: Mapping[int, EndColumns],
    known: Set | None,
) -> list[TurnColumns]:
    """Columns that can change each turn.

    Parameters
    ----------
    turns, views : the turns, and their edges
    dictionary : of the columns
    at_ends : bases that change the inputs in positions, by their first column
    known : set fitted to the windows, if accelerometers during turns are used; or None

    """
    if not turns:
        return []
    every = _concatenate(views)
    cut = np.cumsum([len(view.x) for view in views])[:-1]
    loose = bool(dictionary.unoriented.any())
    found = [TurnColumns(t, v) for t, v in zip(turns, views, strict=True)]

    def on_way(columns: Index) -> Mask | None:
        return None if known is None else turn_force_columns(columns, dictionary, known)

    for first, basis in dictionary.bases:
        if isinstance(basis, Course):
            _add_course(found, first, basis, loose, every, cut)
        elif first in at_ends:
            for one in found:
                scale = one.view.state.scale
                columns, outputs, bent = at_ends[first].columns_for(one.turn, scale)
                one.add_outputs(columns, outputs, on_way(columns), bent)
        else:
            table = _outputs(basis, views, every)
            columns = first + np.arange(table.shape[2])
            used = on_way(columns)
            for one, part in zip(found, np.split(table, cut), strict=True):
                one.add_outputs(columns, part, used)
    return found


def _add_course(
    found: Sequence[TurnColumns],
    first: int,
    course: Course,
    loose: bool,
    every: RowView,
    cut: Index,
) -> None:
    """Add a course to all turns; if ends are `loose`, it rotates the force there."""
    if loose:
        for one in found:
            one.add_still(first + np.arange(3 * course.width))
    if course.timed:
        tables = np.split(course.evaluate(every), cut)
        for one, table in zip(found, tables, strict=True):
            one.add_course(first, table)
    elif course.while_output_stands:
        for one in found:
            if one.turn.standing_share is not None:
                even = np.ones((len(one.view.x), 1))
                one.add_course(first, even, one.turn.standing_share)


def _outputs(basis: General, views: Sequence[RowView], every: RowView) -> Array:
    """Outputs of a basis at the edges of all turns, (n, 6, k)."""
    if basis.needs_whole_turn:
        return np.concatenate([basis.evaluate(view) for view in views])
    return basis.evaluate(every)


def _concatenate(views: Sequence[RowView]) -> RowView:
    """Concatenate the edges of all turns."""
    x = concatenate_rows([view.x for view in views])
    since = np.concatenate([view.since for view in views], axis=1)
    return RowView(x, x, since, views[0].state)
