"""Columns of turns: derivatives of the closure, and of the outputs during a turn.

The closure depends on the outputs of the gyroscopes by the integral (1) of `turn`, and
on the inputs in the positions at both ends. Columns are calculated for all turns at
once, except those that need a whole turn, or that change its ends.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model.causes.basis import Course, General, RowView
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.evidence.sets import Set
from fieldcal.model.system.end_columns import EndColumns
from fieldcal.model.system.turn_force_rows import turn_force_columns
from fieldcal.model.turns.turn import Turn
from fieldcal.physics.experience_rows import concatenate_rows


@dataclass(frozen=True, slots=True)
class TurnColumns:
    """Columns that can change one turn.

    Attributes
    ----------
    index : (k,) columns of the dictionary
    closing : (3, k) derivative of the closure by each, rad
    general : columns of each basis that are used during the turn, and their outputs at
        the edges, (m + 1, 6, j)

    """

    index: Index
    closing: Array
    general: list[tuple[Index, Array]]


@dataclass
class _TurnColumnsBuilder:
    """Collects the columns of one turn."""

    turn: Turn
    view: RowView
    index: list[Index] = field(default_factory=list)
    closing: list[Array] = field(default_factory=list)
    general: list[tuple[Index, Array]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.weights = self.turn.weights(self.view.state.scale[3:])
        self.flat_weights = self.weights.reshape(3, -1)  # (3, 3 (m + 1))

    def no_closing(self, index: Index) -> None:
        """Add columns (k,) that do not change the closure through the gyroscopes."""
        self.index.append(index)
        self.closing.append(np.zeros((3, len(index))))

    def course(self, first: int, table: Array, share: Array | None = None) -> None:
        """Add a function (m + 1, j) on each gyroscope, times `share` (m + 1, 3)."""
        width = table.shape[1]
        for c in range(3):
            weight = self.weights[:, :, c] * (1.0 if share is None else share[:, c])
            self.index.append(first + (3 + c) * width + np.arange(width))
            self.closing.append(weight @ table)

    def general_form(
        self, index: Index, table: Array, bent: Array | float = 0.0
    ) -> None:
        """Add columns (m + 1, 6, k), with their change of the ends, (3, k)."""
        rates = table[:, 3:].reshape(self.flat_weights.shape[1], -1)
        self.index.append(index)
        self.closing.append(self.flat_weights @ rates - bent)

    def met(self) -> TurnColumns:
        """The collected columns."""
        closing = np.concatenate(self.closing, axis=1)
        return TurnColumns(np.concatenate(self.index), closing, self.general)


@dataclass(frozen=True, slots=True)
class _AllTurns:
    """Adds the columns of a basis to all turns at once.

    Attributes
    ----------
    builders : one for each turn
    every : the n edges of all turns, one turn after the other
    cut : first edge of each turn but the first
    dictionary : of the columns
    known : set fitted to the windows, if accelerometers during turns are used; or None

    """

    builders: list[_TurnColumnsBuilder]
    every: RowView
    cut: Index
    dictionary: Dictionary
    known: Set | None

    def split(self, table: Array) -> Iterator[tuple[_TurnColumnsBuilder, Array]]:
        """The builder of each turn, with the rows of a table (n, ...) at its edges."""
        return zip(self.builders, np.split(table, self.cut), strict=True)

    def add_course(self, first: int, course: Course) -> None:
        """Add the columns of a course, of which `first` is the first."""
        if self.dictionary.unoriented.any():  # rotates the force at the ends
            for builder in self.builders:
                builder.no_closing(first + np.arange(3 * course.width))
        if course.timed:
            for builder, table in self.split(course.evaluate(self.every)):
                builder.course(first, table)
        elif course.while_output_stands:
            for builder in self.builders:
                if builder.turn.standing_share is not None:
                    even = np.ones((len(builder.view.x), 1))
                    builder.course(first, even, builder.turn.standing_share)

    def add_end_columns(self, ends: EndColumns) -> None:
        """Add the columns of a basis that changes the inputs in positions."""
        for builder in self.builders:
            columns, outputs, bent = ends.columns_for(
                builder.turn, builder.view.state.scale
            )
            builder.general_form(columns, outputs, bent)
            if self.known is not None:
                kept = turn_force_columns(columns, self.dictionary, self.known)
                builder.general.append((columns[kept], outputs[:, :, kept]))

    def add_outputs(self, first: int, table: Array) -> None:
        """Add columns by their outputs (n, 6, k); `first` is the first of them."""
        columns = first + np.arange(table.shape[2])
        for builder, part in self.split(table):
            builder.general_form(columns, part)
        if self.known is not None:
            kept = turn_force_columns(columns, self.dictionary, self.known)
            for builder, part in self.split(table[:, :, kept]):
                builder.general.append((columns[kept], part))


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
    builders = [_TurnColumnsBuilder(t, v) for t, v in zip(turns, views, strict=True)]
    collected = _AllTurns(builders, every, cut, dictionary, known)
    for first, basis in dictionary.bases:
        if isinstance(basis, Course):
            collected.add_course(first, basis)
        elif first in at_ends:
            collected.add_end_columns(at_ends[first])
        else:
            collected.add_outputs(first, _outputs(basis, views, every))
    return [builder.met() for builder in builders]


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
