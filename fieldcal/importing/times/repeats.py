"""Rows that repeat the row before: a program that wrote each row more than once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array, Block

ALL_BUT_A_FEW = 0.99
"""Share of the rows with the time of the row before that repeat it, where rows were
written several times: a few may be damaged. Of samples that came together, noise makes
nearly all differ."""


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
    >>> distinct_rows(np.array([[1.0], [1.0], [2.0]]), np.zeros(3)).all()
    np.True_
    """
    shared = np.append(np.zeros(min(1, len(t)), dtype=bool), t[1:] == t[:-1])
    again: NDArray[np.bool_] = repeated_rows(table) & shared
    if again.sum() < ALL_BUT_A_FEW * shared.sum():
        return np.ones(len(t), dtype=bool)
    kept: NDArray[np.bool_] = ~again
    return kept


def repeats(block: Block) -> NDArray[np.bool_]:
    """Whether each row has the time and the values of the row before.

    >>> force = np.array([[0.1, 0.2, 9.8]] * 3) + [[0.0], [0.0], [0.1]]
    >>> repeats(Block.of(np.array([1.0, 1.0, 1.0]), force)).tolist()
    [False, True, False]
    """
    again = np.zeros(len(block), dtype=bool)
    some = np.flatnonzero(block.t[1:] == block.t[:-1])
    if len(some):
        values = [block.acc, block.gyr, block.temperature[:, None], block.seq[:, None]]
        again[some + 1] = repeated_rows(np.hstack(values))[some + 1]
    return again
