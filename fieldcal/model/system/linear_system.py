"""The linearised system of a session: what its rows say of every column.

    G = Phi^T R^-1 Phi,    b = Phi^T R^-1 (y - h(state) + Phi u(state))

so that the estimates are those of the parameters themselves, not of their changes.
Channels have rows of their own, and most columns touch one channel only, so G is made
channel by channel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array, Index
from fieldcal.model import priors
from fieldcal.model.causes.cause import CLOSURE
from fieldcal.model.causes.columns import Course, RowView
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.causes.known import KnownRows
from fieldcal.model.evidence.gram import Gram
from fieldcal.model.rows.reduce import Rows
from fieldcal.model.state import State
from fieldcal.model.system.turn_rows import TurnRows
from fieldcal.model.system.window_rows import Linear

NOTHING, SHOWS = 1e-6, 1.0
"""What a column of typical size makes in windows that show it: more than so many m/s^2
on an accelerometer, standard deviations on a gyroscope, which sees the Earth turn."""


class System:
    """Rows and a dictionary, linearised about states.

    Parameters
    ----------
    rows : of the windows
    dictionary : their columns

    """

    def __init__(self, rows: Rows, dictionary: Dictionary) -> None:
        self.rows, self.dictionary = rows, dictionary

    def apart(self) -> System:
        """The same rows with a dictionary of their own, as it is now."""
        return System(self.rows, self.dictionary.apart())

    def linearised(
        self, state: State, wanted: NDArray[np.bool_] | None = None
    ) -> list[Linear]:
        """Rows of every channel about a state, with all columns or those wanted."""
        rows, used = self.rows, self.rows.used
        view = RowView.of(rows.x, self.dictionary.since, state)
        off = rows.y - state.output(view.x, self.dictionary.since)
        parts: list[list[tuple[Index, Array]]] = [[] for _ in range(6)]
        for first, end, basis in self.dictionary.spans():
            at = np.arange(first, end)
            kept = np.ones(len(at), bool) if wanted is None else wanted[at]
            if not kept.any():
                continue
            table = basis.of(view)
            if isinstance(basis, Course):
                self._course(parts, at, table, kept)
                continue
            for c in self.dictionary.observed:
                there = kept & np.any(table[used[:, c], c] != 0.0, axis=0)
                if there.any():
                    parts[c].append((at[there], table[:, c, there]))
        out = []
        for c in self.dictionary.observed:
            use = np.flatnonzero(used[:, c])
            left = self.dictionary.wander.left(rows.length[use], int(c))
            weight = 1 / np.sqrt(rows.sd[use, c] ** 2 + left)
            design = np.hstack([table[use] for _, table in parts[c]]) * weight[:, None]
            columns = np.concatenate([at for at, _ in parts[c]])
            window = np.searchsorted(self.dictionary.held, rows.x.position[use])
            if wanted is None:
                table = np.abs(design) * self.dictionary.typical[columns]
                if c < 3:
                    there = (table / weight[:, None]).max(axis=0) > NOTHING
                else:
                    there = np.linalg.norm(table, axis=0) > SHOWS
                self.dictionary.shown[columns] |= there
            out.append(
                Linear(
                    int(c), use, window, weight, columns, design, off[use, c] * weight
                )
            )
        return out

    def _course(
        self,
        parts: list[list[tuple[Index, Array]]],
        at: Index,
        table: Array,
        kept: NDArray[np.bool_],
    ) -> None:
        """Columns `at` of a function that is the same on every channel, those kept."""
        width = table.shape[1]
        for c in self.dictionary.observed:
            own = slice(c * width, (c + 1) * width)
            if kept[own].any():
                parts[c].append((at[own][kept[own]], table[:, kept[own]]))


def gram(
    linear: Sequence[Linear],
    dictionary: Dictionary,
    values: Array,
    turns: Sequence[TurnRows] = (),
    columns: Index | None = None,
) -> Gram:
    """Add up what rows say; `values` (k,) are those of the columns in the state.

    `columns` are those wanted, all if not given.
    """
    kept = np.arange(dictionary.width) if columns is None else np.unique(columns)
    index = np.full(dictionary.width, -1, dtype=np.intp)
    index[kept] = np.arange(len(kept))
    held = dictionary.held
    size = len(held) + len(turns)
    kind = np.tile(np.arange(6), (size, 1))
    kind[len(held) :] = CLOSURE
    shared = np.zeros((size, 6))
    shared[: len(held)] = dictionary.common
    out = Gram(
        np.zeros((len(kept), len(kept))),
        np.zeros(len(kept)),
        0.0,
        0,
        np.zeros((size, 6, len(kept))),
        np.zeros((size, 6)),
        np.zeros((size, 6)),
        shared,
        np.zeros((size, 6, 2)),
        kind,
        np.zeros((size, 6, 6)),
        index,
    )
    total = [_add_windows(out, part, values) for part in linear]
    for i, turn in enumerate(turns, len(held)):
        total.append(_add_turn(out, i, turn, values))
    if dictionary.known is not None:
        total.append(_add_known(out, dictionary.known))
    for j in np.flatnonzero(dictionary.free):
        at = index[dictionary.rotations_of(held[j])]
        out.loose[j] = priors.SMALL_ROTATION * out.means[j, :, at].T
    return replace(out, square=sum(t[0] for t in total), count=sum(t[1] for t in total))


def _add_windows(out: Gram, part: Linear, values: Array) -> tuple[float, int]:
    """Add one channel's rows; back come its squares about the means and their count."""
    c, all_ = part.channel, out.index[part.columns]
    there = all_ >= 0
    at, design = all_[there], part.design if there.all() else part.design[:, there]
    in_state = np.flatnonzero(values[part.columns])
    white = part.white + part.design[:, in_state] @ values[part.columns[in_state]]
    first = np.flatnonzero(np.diff(part.window, prepend=-1))
    windows = part.window[first]
    weight = np.add.reduceat(part.weight**2, first)
    mean = np.add.reduceat(design * part.weight[:, None], first, axis=0)
    mean /= weight[:, None]
    middle = np.add.reduceat(white * part.weight, first) / weight
    inner = design.T @ design - (mean * weight[:, None]).T @ mean
    out.within[np.ix_(at, at)] += inner
    out.pull[at] += design.T @ white - mean.T @ (weight * middle)
    out.means[windows[:, None], c, at] = mean
    out.off[windows, c], out.info[windows, c] = middle, weight
    return float(white @ white) - float(weight @ middle**2), len(white) - len(windows)


def _add_known(out: Gram, known: KnownRows) -> tuple[float, int]:
    """Add what is known from elsewhere of the columns that are here."""
    all_ = out.index[known.columns]
    at, design = all_[all_ >= 0], known.design[:, all_ >= 0]
    out.within[np.ix_(at, at)] += design.T @ design
    out.pull[at] += design.T @ known.off
    return float(known.off @ known.off), len(known.off)


def _add_turn(out: Gram, i: int, turn: TurnRows, values: Array) -> tuple[float, int]:
    """Add one turn's closure and way as well."""
    all_, some = out.index[turn.columns], len(turn.closure)
    there = all_ >= 0
    at = all_[there]
    out.off[i, :some], out.info[i, :some] = turn.closure, turn.info
    out.means[i, :some, at] = turn.design[:, there].T
    out.bent[i, :some, :3] = turn.bent
    if not len(turn.way):
        return 0.0, 0
    design = turn.way_design[:, there]
    out.within[np.ix_(at, at)] += design.T @ design
    out.pull[at] += design.T @ turn.way
    return float(turn.way @ turn.way), len(turn.way)
