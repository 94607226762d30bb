"""Rows of the windows and their dictionary: means at rest, linearised."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Self

import numpy as np

from fieldcal.core.samples import GYR, Array, Index, Mask
from fieldcal.model import tolerances
from fieldcal.model.causes.basis import RowView
from fieldcal.model.causes.cause import Basis
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.rows.averages import Rows
from fieldcal.model.state import State
from fieldcal.model.system.linear_rows import ChannelRows, LinearRows
from fieldcal.model.system.linear_system import System
from fieldcal.model.system.starting_angles import starting_angles


class WindowSystem(System):
    """Rows of windows, and a dictionary of their columns, linearised about states."""

    def __init__(self, rows: Rows, dictionary: Dictionary) -> None:
        super().__init__(dictionary)
        self.rows = rows
        self._last: tuple[State, int, list[LinearRows]] | None = None
        self._view: RowView | None = None

    def linearised(self, state: State, wanted: Mask | None = None) -> list[LinearRows]:
        """Rows of every channel about a state, with all columns or those wanted.

        Those with all columns are kept, until another state is asked for. Columns that
        were added to the dictionary since are added to them.
        """
        if wanted is not None:
            return super().linearised(state, wanted)
        count, width, rows = 0, self.dictionary.width, list[LinearRows]()
        if self._last is not None and self._last[0] is state:
            _, count, rows = self._last
        if count < width:
            new = self._with_columns(state, np.arange(width) >= count)
            self._note_shown(new)
            rows = _joined(rows, new)
            self._last = state, width, rows
        return rows

    def independent_copy(self) -> Self:
        """The same rows with a copy of the dictionary."""
        return type(self)(self.rows, self.dictionary.independent_copy())

    @property
    def used(self) -> Mask:
        """Rows with a value, by channel, (n, 6)."""
        return self.rows.used

    def linearisation_error(
        self, state: State, other: State, step: Array, everywhere: bool = False
    ) -> float:
        """Largest error of the means at another state, linearised about a state, σ.

        Windows of unknown orientation count only `everywhere`.
        """
        d, x = self.dictionary, self.rows.x
        outputs, outputs_at_other = (
            s.output(RowView.of(x, d.since, s).x, d.since) for s in (state, other)
        )
        wanted, largest = step != 0, 0.0
        wanted[d.bias : d.bias + 6] = True  # so that every channel has its rows
        for part in self.linearised(state, wanted):
            moved = (outputs_at_other - outputs)[part.rows, part.channel] * part.weight
            off = part.window_means(moved - part.design @ step[part.columns])
            counted = everywhere | ~d.unoriented[part.windows]
            sigmas = np.abs(off) * np.sqrt(part.info)
            largest = max(largest, float(sigmas[counted].max(initial=0.0)))
        return largest

    def starting_angles(self, nominal: State, position: int) -> Array:
        """Turn of a position to where its mean force is, (2,) rad; zero if near."""
        return starting_angles(self.rows, nominal, position)

    def _about(self, state: State) -> tuple[Callable[[Basis], Array], Array]:
        """What evaluates a basis about a state; recorded less calculated, (n, 6)."""
        view = self._view
        if view is None or view.state is not state:
            view = self._view = RowView.of(self.rows.x, self.dictionary.since, state)
        off = self.rows.y - state.output(view.x, view.since)
        return (lambda basis: basis.evaluate(view)), off

    def _whitened(
        self, channel: int, columns: Index, table: Array, off: Array
    ) -> LinearRows:
        """Rows of a channel with columns (k,), of a table (n, k) and residuals (n,)."""
        of = self._channels[channel]
        weight = of.weight
        design, white = table[of.rows] * weight[:, None], off[of.rows] * weight
        return of.linearised(columns, design, white)

    @cached_property
    def _channels(self) -> list[ChannelRows]:
        """Used rows of each channel, with their weights."""
        rows, d, out = self.rows, self.dictionary, list[ChannelRows]()
        for c in range(6):
            use = np.flatnonzero(rows.used[:, c])
            left = d.wander.residual_variance_of_rows(rows.length, c)[use]
            weight = 1 / np.sqrt(rows.sd[use, c] ** 2 + left)
            window = np.searchsorted(d.window_positions, rows.x.position[use])
            out.append(ChannelRows(c, use, window, weight))
        return out

    def _shows(self, part: LinearRows) -> Mask:
        """Whether each column of a channel shows at its typical size, (k,).

        Gyroscopes measure the Earth's rate, so there it must exceed the noise.
        """
        if part.channel >= GYR.start:
            return super()._shows(part)
        size = (np.abs(part.design) / part.weight[:, None]).max(axis=0)
        shows: Mask = (
            size * self.dictionary.typical[part.columns] > tolerances.MIN_VISIBLE_ACC
        )
        return shows


def _joined(rows: Sequence[LinearRows], more: Sequence[LinearRows]) -> list[LinearRows]:
    """Rows of channels, with the columns of both, the channels in their order."""
    by_channel = {part.channel: part for part in rows}
    for part in more:
        own = by_channel.get(part.channel)
        by_channel[part.channel] = part if own is None else own.with_columns(part)
    return [by_channel[c] for c in sorted(by_channel)]
