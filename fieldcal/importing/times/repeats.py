"""Rows that repeat the row before: a program that wrote each row more than once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array, Block

ALL_BUT_A_FEW = 0.99
"""Share of the rows with the time of the row before that repeat it, or of the rows that
are there as often as usual, where rows were written several times: a few may be
damaged. Of samples that came together, noise makes nearly all differ."""


NO_VALUES = ("seq", "t_host")
"""Channels that are no values: a row that was written twice may be counted twice."""


def repeated_rows(table: Array) -> NDArray[np.bool_]:
    """Whether each row (n, k) has the values of the row before; nan is one of them.

    >>> repeated_rows(np.array([[1.0, np.nan], [1.0, np.nan], [1.0, 2.0]])).tolist()
    [False, True, False]
    """
    last, row = table[:-1], table[1:]
    same = ((last == row) | (np.isnan(last) & np.isnan(row))).all(axis=1)
    return np.append(np.zeros(min(1, len(table)), dtype=bool), same)


def distinct_rows(table: Array, t: Array) -> NDArray[np.bool_]:
    """Which rows of a table (n, k) are not written again, where rows share times (n,).

    Where rows differ from the one that has their time, they came together: a device
    at rest repeats a value by chance, and every row counts.

    >>> distinct_rows(np.array([[1.0], [1.0], [2.0]]), np.array([0.0, 0.0, 1.0]))
    array([ True, False,  True])
    >>> distinct_rows(np.array([[1.0], [1.0], [2.0], [3.0]]), np.zeros(4)).all()
    np.True_

    Where all rows are there as often, they were written several times nevertheless.

    >>> distinct_rows(np.array([[1.0], [1.0], [2.0], [2.0]]), np.zeros(4))
    array([ True, False,  True, False])
    """
    shared = np.append(np.zeros(min(1, len(t)), dtype=bool), t[1:] == t[:-1])
    again: NDArray[np.bool_] = repeated_rows(table) & shared
    # of a clock that is too coarse, rows that differ share a time as well
    many = np.diff(np.flatnonzero(~again))
    usual = float(np.median(many)) if len(many) else 1.0
    alike = usual > 1 and (many == usual).mean() >= ALL_BUT_A_FEW
    if again.sum() < ALL_BUT_A_FEW * shared.sum() and not alike:
        return np.ones(len(t), dtype=bool)
    kept: NDArray[np.bool_] = ~again
    return kept


def repeats(block: Block) -> NDArray[np.bool_]:
    """Whether each row has the time and the values of the row before.

    A counter is no value, so two rows that differ in nothing else are the same.

    >>> force = np.array([[0.1, 0.2, 9.8]] * 3) + [[0.0], [0.0], [0.1]]
    >>> repeats(Block.of(np.array([1.0, 1.0, 1.0]), force)).tolist()
    [False, True, False]
    """
    again = np.zeros(len(block), dtype=bool)
    some = np.flatnonzero(block.t[1:] == block.t[:-1])
    if len(some):
        values = [block.acc, block.gyr, block.temperature[:, None]]
        again[some + 1] = repeated_rows(np.hstack(values))[some + 1]
    return again


class RepeatFinder:
    """Finds rows that repeat the row before, whatever the pieces in which they come."""

    def __init__(self) -> None:
        self._last: Array | None = None

    def of(self, columns: Sequence[Array]) -> NDArray[np.bool_]:
        """Whether each row of some columns (n,) repeats the row before."""
        table = np.column_stack(columns)
        before = table[:1] + np.nan if self._last is None else self._last
        again = repeated_rows(np.concatenate([before, table]))[1:]
        if self._last is None and len(again):
            again[0] = False
        self._last = table[-1:] if len(table) else self._last
        return again
