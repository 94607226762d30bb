"""Rows of the windows and their dictionary: means at rest, linearised."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import numpy as np

from fieldcal.core.samples import Array, Index, Mask
from fieldcal.model.causes.basis import Course, RowView
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.rows.averages import Rows
from fieldcal.model.state import State
from fieldcal.model.system.linear_rows import LinearRows
from fieldcal.model.system.linear_system import (
    MIN_VISIBLE_SIGMAS,
    Parts,
    System,
    append_course,
)
from fieldcal.model.system.starting_angles import starting_angles

MIN_VISIBLE_ACC = 1e-6
"""Least change of an accelerometer by a column of typical size that windows show,
m/s^2."""


class WindowSystem(System):
    """Rows of the windows and a dictionary, linearised about states.

    Parameters
    ----------
    rows : of the windows
    dictionary : their columns

    """

    def __init__(self, rows: Rows, dictionary: Dictionary) -> None:
        super().__init__(dictionary)
        self.rows = rows

    def independent_copy(self) -> Self:
        """The same rows with a copy of the dictionary."""
        return type(self)(self.rows, self.dictionary.independent_copy())

    def linearised(self, state: State, wanted: Mask | None = None) -> list[LinearRows]:
        """Rows of every channel about a state, with all columns or those wanted."""
        d = self.dictionary
        view = RowView.of(self.rows.x, d.since, state)
        off = self.rows.y - state.output(view.x, d.since)
        asked = np.ones(d.width, bool) if wanted is None else wanted
        parts = self._parts(view, asked)
        out = [
            self._channel(c, channel_parts, off[:, c])
            for c, channel_parts in parts.items()
        ]
        if wanted is None:
            for part in out:
                d.shown[part.columns] |= self._shows(part)
        return out

    def linearisation_error(self, state: State, other: State, step: Array) -> float:
        """Largest error of the means at another state, linearised about a state, σ.

        Windows of unknown orientation do not count.
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
            counted = ~d.unoriented[part.windows]
            sigmas = np.abs(off) * np.sqrt(part.info)
            largest = max(largest, float(sigmas[counted].max(initial=0.0)))
        return largest

    def starting_angles(self, nominal: State, position: int) -> Array:
        """Turn of a position to where its mean force is, (2,) rad; zero if near."""
        return starting_angles(self.rows, nominal, position)

    def _parts(self, view: RowView, wanted: Mask) -> Parts:
        """Wanted columns with influence on each channel."""
        parts: Parts = {c: [] for c in self.dictionary.observed.tolist()}
        for first, end, basis in self.dictionary.basis_ranges():
            at, kept = np.arange(first, end), wanted[first:end]
            if not kept.any():
                continue
            table = basis.evaluate(view)
            if isinstance(basis, Course):
                append_course(parts, at, table, kept)
                continue
            if not kept.all():
                at, table = at[kept], table[:, :, kept]
            touched = table != 0.0
            for c, channel_parts in parts.items():
                shown = (touched[:, c] & self.rows.used[:, c, None]).any(axis=0)
                if shown.any():
                    channel_parts.append((at[shown], table[:, c, shown]))
        return parts

    def _channel(
        self, c: int, parts: Sequence[tuple[Index, Array]], off: Array
    ) -> LinearRows:
        """One channel's rows, whitened."""
        rows, d = self.rows, self.dictionary
        use = np.flatnonzero(rows.used[:, c])
        left = d.wander.residual_variance_of_rows(rows.length, c)[use]
        weight = 1 / np.sqrt(rows.sd[use, c] ** 2 + left)
        design = np.hstack([table[use] for _, table in parts]) * weight[:, None]
        columns = np.concatenate([at for at, _ in parts])
        window = np.searchsorted(d.window_positions, rows.x.position[use])
        return LinearRows(c, use, window, weight, columns, design, off[use] * weight)

    def _shows(self, part: LinearRows) -> Mask:
        """Whether each column of a channel shows at its typical size, (k,).

        Gyroscopes measure the Earth's rate, so there it must exceed the noise.
        """
        table = np.abs(part.design) * self.dictionary.typical[part.columns]
        if part.channel < 3:
            visible: Mask = (table / part.weight[:, None]).max(axis=0) > MIN_VISIBLE_ACC
            return visible
        stands_out: Mask = np.linalg.norm(table, axis=0) > MIN_VISIBLE_SIGMAS
        return stands_out
