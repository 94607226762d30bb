"""Columns of turns: derivatives of the closure, and of the outputs during a turn.

The closure depends on the outputs of the gyroscopes by the integral (1) of `turn`, and
on the inputs in the positions at both ends. Columns are calculated for all turns at
once, except those that need a whole turn, or that change its ends.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from fieldcal.core.samples import Array, Index, Mask
from fieldcal.model.causes.basis import Course, General, RowView
from fieldcal.model.causes.cause import Basis
from fieldcal.model.state import State
from fieldcal.model.system.end_columns import EndColumns, positions_about
from fieldcal.model.turns.turn import Turn
from fieldcal.physics.experience import Experience
from fieldcal.physics.experience_rows import concatenate_rows


class TurnColumns:
    """Columns that can change one turn, with edges `view`.

    Attributes
    ----------
    general : columns of each basis that is no course, and their outputs at the edges,
        (m + 1, 6, j); kept if accelerometers during the turn are used

    """

    def __init__(self, turn: Turn, view: RowView, way: bool) -> None:
        self.turn, self.view, self.way = turn, view, way
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
        self, index: Index, outputs: Array, bent: Array | float = 0.0
    ) -> None:
        """Add columns by their outputs, (m + 1, 6, k).

        `bent` is how they change the closure by the ends, (3, k).
        """
        weights = self._weights.reshape(3, -1)  # (3, 3 (m + 1))
        rates = outputs[:, 3:].reshape(weights.shape[1], -1)
        self._columns.append((index, weights @ rates - bent))
        if self.way:
            self.general.append((index, outputs))

    def during_turn(self, used: Mask) -> list[tuple[Index, Array]]:
        """The `general` columns that are `used` during the turn, (all,)."""
        out = []
        for index, outputs in self.general:
            if (kept := used[index]).any():
                out.append((index[kept], outputs[:, :, kept]))
        return out


@dataclass
class ColumnsOfTurns:
    """Columns that can change each turn, all about one state.

    The columns of a basis are calculated once, when it is first asked for.

    Attributes
    ----------
    state : of the turns
    turns : integrated with the state
    views : their edges
    way : whether accelerometers during the turns are used
    found : columns of each turn

    """

    state: State
    turns: Sequence[Turn]
    views: Sequence[RowView]
    way: bool
    _held: RowView | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        pairs = zip(self.turns, self.views, strict=True)
        self.found = [TurnColumns(turn, view, self.way) for turn, view in pairs]
        self._count = 0

    def of_bases(
        self,
        bases: Sequence[tuple[int, Basis]],
        windows: Experience,
        loose: bool,
    ) -> list[TurnColumns]:
        """Columns of each turn by all of some bases, each with its first column.

        The bases of an earlier call come first. `windows` are the rows of the windows;
        accelerometers rotate the force at ends that are `loose`.
        """
        if not self.turns:
            return []
        new, self._count = bases[self._count :], len(bases)
        for first, basis in new:
            if isinstance(basis, Course):
                self._add_course(first, basis, loose)
            elif basis.sides is not None:
                self._add_at_ends(EndColumns.of(first, basis, self._places(windows)))
            else:
                table = _outputs(basis, self.views, self._every)
                columns = first + np.arange(table.shape[2])
                parts = np.split(table, self._cut)
                for one, part in zip(self.found, parts, strict=True):
                    one.add_outputs(columns, part)
        return self.found

    @cached_property
    def _every(self) -> RowView:
        """The edges of all turns."""
        return _concatenate(self.views)

    @cached_property
    def _cut(self) -> Index:
        """First edge of each turn but the first, among all."""
        out: Index = np.cumsum([len(view.x) for view in self.views])[:-1]
        return out

    def _places(self, windows: Experience) -> RowView:
        """The positions of the windows' rows; calculated once."""
        if self._held is None:
            self._held = positions_about(windows, self.state)
        return self._held

    def _add_at_ends(self, at_ends: EndColumns) -> None:
        """Add a basis that changes the inputs in positions."""
        columns = at_ends.columns_of(self.turns, self.state.scale)
        for one, parts in zip(self.found, columns, strict=True):
            one.add_outputs(*parts)

    def _add_course(self, first: int, course: Course, loose: bool) -> None:
        """Add a course to all turns; it rotates the force at ends that are `loose`."""
        if loose:
            for one in self.found:
                one.add_still(first + np.arange(3 * course.width))
        if course.timed:
            tables = np.split(course.evaluate(self._every), self._cut)
            for one, table in zip(self.found, tables, strict=True):
                one.add_course(first, table)
        elif course.while_output_stands:
            for one in self.found:
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
