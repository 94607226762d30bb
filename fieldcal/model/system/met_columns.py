"""Columns that turns meet: how each moves a closure, and what it does on the way.

The closure is moved by the integral (1) of `turn` over the outputs of the gyroscopes,
and by what is experienced in the positions at both ends. Columns are calculated for all
turns at once, but for those that need the whole of one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model.causes.columns import Course, General, RowView
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.evidence.sets import Set
from fieldcal.model.system.end_columns import EndColumns
from fieldcal.model.system.way_rows import on_the_way
from fieldcal.model.turns.turn import Turn, joined


@dataclass(frozen=True, slots=True)
class Met:
    """What one turn can meet.

    Attributes
    ----------
    index : (k,) columns of the dictionary
    closing : (3, k) how the closure moves with each, rad
    general : columns of each basis that are looked at on the way, and their outputs at
        the edges, (m + 1, 6, j)

    """

    index: Index
    closing: Array
    general: list[tuple[Index, Array]]


@dataclass
class _Meeting:
    """One turn, and the columns that it has met so far."""

    turn: Turn
    view: RowView
    index: list[Index] = field(default_factory=list)
    closing: list[Array] = field(default_factory=list)
    general: list[tuple[Index, Array]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.weights = self.turn.weights(self.view.state.scale[3:])

    def no_closing(self, index: Index) -> None:
        """Columns (k,) that do not move the closure by what gyroscopes put out."""
        self.index.append(index)
        self.closing.append(np.zeros((3, len(index))))

    def course(self, first: int, table: Array, share: Array | None = None) -> None:
        """A function of the row (m + 1, j) on each gyroscope, or some share of it."""
        width = table.shape[1]
        for c in range(3):
            weight = self.weights[:, :, c] * (1.0 if share is None else share[:, c])
            self.index.append(first + (3 + c) * width + np.arange(width))
            self.closing.append(weight @ table)

    def general_form(self, index: Index, table: Array, bent: Array) -> None:
        """Columns (m + 1, 6, k) of any form, and what they bend at the ends, (3, k)."""
        turned = np.tensordot(self.weights, table[:, 3:], 2)
        self.index.append(index)
        self.closing.append(turned - bent)

    def met(self) -> Met:
        """All of them."""
        closing = np.concatenate(self.closing, axis=1)
        return Met(np.concatenate(self.index), closing, self.general)


def met_columns(
    turns: Sequence[Turn],
    views: Sequence[RowView],
    dictionary: Dictionary,
    at_ends: Mapping[int, EndColumns],
    known: Set | None,
) -> list[Met]:
    """What each turn can meet.

    Parameters
    ----------
    turns, views : the turns, and their edges as columns see them
    dictionary : its columns
    at_ends : bases that change what is experienced in positions, by their first column
    known : what windows say, if the way is looked at

    """
    if not turns:
        return []
    found = [_Meeting(t, v) for t, v in zip(turns, views, strict=True)]
    every = _joined(views)
    cut = np.cumsum([len(view.x) for view in views])[:-1]
    for first, one in dictionary.bases:
        if isinstance(one, Course):
            if dictionary.free.any():  # it turns the force that is seen at the ends
                for some in found:
                    some.no_closing(first + np.arange(3 * one.width))
            if one.timed:
                for some, course in zip(
                    found, np.split(one.of(every), cut), strict=True
                ):
                    some.course(first, course)
            elif one.standing:
                for some in found:
                    if some.turn.stands is not None:
                        even = np.ones((len(some.view.x), 1))
                        some.course(first, even, some.turn.stands)
            continue
        for some, (columns, table, bent) in zip(
            found, _general(first, one, found, every, cut, at_ends), strict=True
        ):
            some.general_form(columns, table, bent)
            if known is not None:
                kept = on_the_way(columns, dictionary, known)
                some.general.append((columns[kept], table[:, :, kept]))
    return [some.met() for some in found]


def _general(
    first: int,
    one: General,
    found: Sequence[_Meeting],
    every: RowView,
    cut: Index,
    at_ends: Mapping[int, EndColumns],
) -> Iterator[tuple[Index, Array, Array]]:
    """Columns (k,) of each turn, their outputs (m + 1, 6, k), what bends (3, k)."""
    if first in at_ends:
        for some in found:
            yield at_ends[first].met_by(some.turn, some.view.state.scale)
        return
    if one.along:
        parts = [one.of(some.view) for some in found]
    else:
        parts = np.split(one.of(every), cut)
    for table in parts:
        width = table.shape[2]
        yield first + np.arange(width), table, np.zeros((3, width))


def _joined(views: Sequence[RowView]) -> RowView:
    """The edges of all turns, one after the other."""
    x = joined([view.x for view in views])
    since = np.concatenate([view.since for view in views], axis=1)
    return RowView(x, x, since, views[0].state)
