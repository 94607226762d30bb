"""The linearised system of a session: the Gram matrix of its rows.

    G = Phi^T R^-1 Phi,    b = Phi^T R^-1 (y - h(state) + Phi u(state))

so that the estimates are those of the parameters themselves, not of their changes.
Channels have rows of their own, and most columns touch one channel only, so G is made
channel by channel.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Self

import numpy as np

from fieldcal.core.samples import Array, Index, Mask
from fieldcal.model import priors, thresholds
from fieldcal.model.causes.basis import Course
from fieldcal.model.causes.cause import CLOSURE, Basis
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.causes.known_rows import KnownRows
from fieldcal.model.evidence.block_sum import BlockSum
from fieldcal.model.evidence.gram import Gram
from fieldcal.model.state import State
from fieldcal.model.system.linear_rows import LinearRows
from fieldcal.model.system.turn_rows import TurnRows

Parts = dict[int, list[tuple[Index, Array]]]
"""For each channel: columns with influence on it, and their values, (n, k)."""


class System(ABC):
    """Rows, and a dictionary of their columns, linearised about states."""

    def __init__(self, dictionary: Dictionary) -> None:
        self.dictionary = dictionary

    @abstractmethod
    def independent_copy(self) -> Self:
        """The same rows with a copy of the dictionary."""

    @property
    @abstractmethod
    def used(self) -> Mask:
        """Rows with a value, by channel, (n, 6)."""

    def linearised(self, state: State, wanted: Mask | None = None) -> list[LinearRows]:
        """Rows of every channel about a state, with all columns or those wanted."""
        asked = self._every_column() if wanted is None else wanted
        out = self._with_columns(state, asked)
        if wanted is None:
            self._note_shown(out)
        return out

    def _with_columns(self, state: State, wanted: Mask) -> list[LinearRows]:
        """Rows of the channels that wanted columns have influence on."""
        table_of, off = self._about(state)
        return [
            self._whitened(
                c,
                np.concatenate([at for at, _ in parts]),
                np.hstack([table for _, table in parts]),
                off[:, c],
            )
            for c, parts in self._parts(table_of, wanted).items()
            if parts
        ]

    def _note_shown(self, linear: Sequence[LinearRows]) -> None:
        """Note which columns rows show, in the dictionary."""
        for part in linear:
            self.dictionary.shown[part.columns] |= self._shows(part)

    @abstractmethod
    def _about(self, state: State) -> tuple[Callable[[Basis], Array], Array]:
        """What evaluates a basis about a state; recorded less calculated, (n, 6)."""

    @abstractmethod
    def _whitened(
        self, channel: int, columns: Index, table: Array, off: Array
    ) -> LinearRows:
        """Rows of a channel with columns (k,), of a table (n, k) and residuals (n,)."""

    def _every_column(self) -> Mask:
        """The columns of rows that are linearised with all of them."""
        return np.ones(self.dictionary.width, dtype=bool)

    def _shows(self, part: LinearRows) -> Mask:
        """Whether each column of a channel exceeds the noise at typical size, (k,)."""
        typical = self.dictionary.typical[part.columns]
        shows: Mask = np.linalg.norm(part.design, axis=0) * typical > thresholds.VISIBLE
        return shows

    def _parts(self, table_of: Callable[[Basis], Array], wanted: Mask) -> Parts:
        """Wanted columns with influence on each channel."""
        parts: Parts = {c: [] for c in self.dictionary.observed.tolist()}
        used = self.used
        for first, end, basis in self.dictionary.basis_ranges():
            at, kept = np.arange(first, end), wanted[first:end]
            if not kept.any():
                continue
            table = table_of(basis)
            if isinstance(basis, Course):
                _append_course(parts, at, table, kept)
                continue
            if not kept.all():
                at, table = at[kept], table[:, :, kept]
            touched = ((table != 0.0) & used[:, :, None]).any(axis=0)
            for c, channel_parts in parts.items():
                if (shown := np.flatnonzero(touched[c])).size:
                    channel_parts.append((at[shown], table[:, c, shown]))
        return parts

    def linearisation_error(
        self, state: State, other: State, step: Array, everywhere: bool = False
    ) -> float:
        """Largest error of the rows of another state, linearised about a state.

        `step` (k,) is the change of the columns in the state. In standard deviations of
        a window's mean; 0 where the rows are linear. Windows of unknown orientation
        count only `everywhere`: what they turn by is free.
        """
        return 0.0

    def starting_angles(self, nominal: State, position: int) -> Array:
        """Turn of a position from which to begin, (2,) rad; zero if nothing tells."""
        return np.zeros(2)


def _append_course(parts: Parts, at: Index, table: Array, kept: Mask) -> None:
    """Append the columns `at` of a `Course`, as far as they are `kept`, to `parts`."""
    width = table.shape[1]
    for c, channel_parts in parts.items():
        own = slice(c * width, (c + 1) * width)
        if kept[own].any():
            channel_parts.append((at[own][kept[own]], table[:, kept[own]]))


def gram(
    linear: Sequence[LinearRows],
    dictionary: Dictionary,
    values: Array,
    turns: Sequence[TurnRows] = (),
    columns: Index | None = None,
) -> Gram:
    """Gram matrix of windows, turns and prior knowledge.

    `values` (k,) are those of the columns in the state; `columns` are those wanted, all
    if None.
    """
    kept = np.arange(dictionary.width) if columns is None else np.unique(columns)
    out = _empty_gram(dictionary, kept, len(turns))
    held, index = dictionary.window_positions, out.index
    free = np.zeros(dictionary.width, dtype=bool)
    for j in np.flatnonzero(dictionary.unoriented):
        free[dictionary.rotations_of(held[j])] = True
    if columns is not None:
        linear = [part.select_columns(index >= 0) for part in linear]
    squares = [_add_windows(out, part, values, free) for part in linear]
    blocks = [(index[part.columns], part.courses) for part in linear]
    for i, turn in enumerate(turns, len(held)):
        _add_closure(out, i, turn)
    white = [_rows_on_way(index, turn) for turn in turns if len(turn.way)]
    if dictionary.known is not None:
        white.append(_known_rows(index, dictionary.known))
    for at, design, off in white:
        out.rhs[at] += design.T @ off
        squares.append(float(off @ off))
    within = BlockSum.of(len(kept), [*blocks, *_products(white)])
    if columns is not None:
        within = within.select(np.arange(len(kept)))
    for j in np.flatnonzero(dictionary.unoriented):
        at = index[dictionary.rotations_of(held[j])]
        out.free_rotations[j] = priors.SMALL_ROTATION * out.means[j, :, at].T
    return replace(out, within=within, square=sum(squares))


def _empty_gram(dictionary: Dictionary, kept: Index, turns: int) -> Gram:
    """Gram matrix of some columns (k,) without any row."""
    index = np.full(dictionary.width, -1, dtype=np.intp)
    index[kept] = np.arange(len(kept))
    held, k = len(dictionary.window_positions), len(kept)
    size = held + turns
    kind = np.tile(np.arange(6), (size, 1))
    kind[held:] = CLOSURE
    shared = np.zeros((size, 6))
    shared[:held] = dictionary.window_error
    return Gram(
        within=BlockSum.of(k, ()), rhs=np.zeros(k), square=0.0,
        means=np.zeros((size, 6, k)), residual=np.zeros((size, 6)),
        info=np.zeros((size, 6)), shared=shared, free_rotations=np.zeros((size, 6, 2)),
        kind=kind, closure_errors=np.zeros((size, 6, 6)), index=index,
    )  # fmt: skip


def _add_windows(out: Gram, part: LinearRows, values: Array, free: Mask) -> float:
    """Add one channel's rows; returns its squares about the means.

    Of the columns `free` (k,), rotations of unknown orientations, only the means are
    estimated. What such a rotation does within a window, where an effect turns the
    device there, stays what it is in the state.
    """
    c, at, design, mean = part.channel, out.index[part.columns], part.design, part.means
    in_state = np.where(free[part.columns], 0.0, values[part.columns])
    white = part.white + design @ in_state
    rotated = mean @ (values[part.columns] - in_state)
    windows, weight, middle = part.windows, part.info, part.window_means(white)
    out.rhs[at] += design.T @ white - mean.T @ (weight * middle)
    out.means[windows[:, None], c, at] = mean
    out.residual[windows, c] = middle + rotated
    out.info[windows, c] = weight
    return float(white @ white) - float(weight @ middle**2)


def _add_closure(out: Gram, i: int, turn: TurnRows) -> None:
    """Add a turn's closure."""
    every, count = out.index[turn.columns], len(turn.closure)
    selected = every >= 0
    out.residual[i, :count], out.info[i, :count] = turn.closure, turn.info
    out.means[i, :count, every[selected]] = turn.design[:, selected].T
    out.closure_errors[i, :count] = turn.closure_errors


WhiteRows = tuple[Index, Array, Array]
"""Columns (c,) of a Gram matrix, whitened rows (r, c) of them, and right-hand side."""


def _rows_on_way(index: Index, turn: TurnRows) -> WhiteRows:
    """Rows of the way of a turn; few columns: what no window shows."""
    every = index[turn.columns]
    on_way = (every >= 0) & turn.way_design.any(axis=0)
    return every[on_way], turn.way_design[:, on_way], turn.way


def _known_rows(index: Index, known: KnownRows) -> WhiteRows:
    """Rows of prior knowledge of columns."""
    every = index[known.columns]
    return every[every >= 0], known.design[:, every >= 0], known.residual


def _products(white: Sequence[WhiteRows]) -> list[tuple[Index, Array]]:
    """Products of the columns of some rows, in one block."""
    if not white:
        return []
    columns = np.unique(np.concatenate([at for at, _, _ in white]))
    block = np.zeros((len(columns), len(columns)))
    for at, design, _ in white:
        place = np.searchsorted(columns, at)
        block[np.ix_(place, place)] += design.T @ design
    return [(columns, block)]
