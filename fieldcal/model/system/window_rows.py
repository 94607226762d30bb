"""Rows of the windows and their dictionary: means at rest, linearised."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array, Index
from fieldcal.model.causes.columns import Course, RowView
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.rows.reduce import Rows
from fieldcal.model.state import State
from fieldcal.model.system.linear_rows import Linear
from fieldcal.model.system.linear_system import SHOWS, Parts, System, add_course

NOTHING = 1e-6
"""What a column of typical size makes on an accelerometer in windows that show it, at
least, m/s^2."""


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

    def apart(self) -> Self:
        """The same rows with a dictionary of their own, as it is now."""
        return type(self)(self.rows, self.dictionary.apart())

    def linearised(
        self, state: State, wanted: NDArray[np.bool_] | None = None
    ) -> list[Linear]:
        """Rows of every channel about a state, with all columns or those wanted."""
        d = self.dictionary
        view = RowView.of(self.rows.x, d.since, state)
        off = self.rows.y - state.output(view.x, d.since)
        asked = np.ones(d.width, bool) if wanted is None else wanted
        parts = self._parts(view, asked)
        out = [self._channel(c, some, off[:, c]) for c, some in parts.items()]
        if wanted is None:
            for part in out:
                d.shown[part.columns] |= self._shows(part)
        return out

    def _parts(self, view: RowView, wanted: NDArray[np.bool_]) -> Parts:
        """Columns of each channel that are wanted and touch it."""
        parts: Parts = {c: [] for c in self.dictionary.observed.tolist()}
        for first, end, basis in self.dictionary.spans():
            at, kept = np.arange(first, end), wanted[first:end]
            if not kept.any():
                continue
            table = basis.of(view)
            if isinstance(basis, Course):
                add_course(parts, at, table, kept)
                continue
            if not kept.all():
                at, table = at[kept], table[:, :, kept]
            touched = table != 0.0
            for c, some in parts.items():
                there = (touched[:, c] & self.rows.used[:, c, None]).any(axis=0)
                if there.any():
                    some.append((at[there], table[:, c, there]))
        return parts

    def _channel(
        self, c: int, parts: Sequence[tuple[Index, Array]], off: Array
    ) -> Linear:
        """One channel's rows, whitened."""
        rows, d = self.rows, self.dictionary
        use = np.flatnonzero(rows.used[:, c])
        left = d.wander.left_of_rows(rows.length, c)[use]
        weight = 1 / np.sqrt(rows.sd[use, c] ** 2 + left)
        design = np.hstack([table[use] for _, table in parts]) * weight[:, None]
        columns = np.concatenate([at for at, _ in parts])
        window = np.searchsorted(d.held, rows.x.position[use])
        return Linear(c, use, window, weight, columns, design, off[use] * weight)

    def _shows(self, part: Linear) -> NDArray[np.bool_]:
        """Whether each column of a channel shows at its typical size, (k,).

        A gyroscope sees the Earth turn, so there it has to stand out of the noise.
        """
        table = np.abs(part.design) * self.dictionary.typical[part.columns]
        if part.channel < 3:
            there: NDArray[np.bool_] = (table / part.weight[:, None]).max(
                axis=0
            ) > NOTHING
            return there
        stands_out: NDArray[np.bool_] = np.linalg.norm(table, axis=0) > SHOWS
        return stands_out
