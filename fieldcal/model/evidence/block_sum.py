"""A symmetric matrix as a sum of blocks, each at some of its rows and columns.

Channels have rows of their own, and most columns have influence on one channel only: of
the products of all columns with each other, five of six are zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array, Index


@dataclass(frozen=True, slots=True)
class BlockSum:
    """A symmetric matrix (k, k), the sum of blocks.

    Attributes
    ----------
    size : k
    blocks : for each block its rows and columns (m,), and its values (m, m)
    places : for each block the place of each row and column in it, (k,), -1 if absent

    """

    size: int
    blocks: tuple[tuple[Index, Array], ...]
    places: tuple[Index, ...]

    @classmethod
    def of(cls, size: int, blocks: Sequence[tuple[Index, Array]]) -> BlockSum:
        """The sum of some blocks, each with its rows and columns."""
        places = []
        for at, _ in blocks:
            place = np.full(size, -1, dtype=np.intp)
            place[at] = np.arange(len(at))
            places.append(place)
        return cls(size, tuple(blocks), tuple(places))

    def part(self, rows: Index, columns: Index) -> Array:
        """The elements of some rows and columns, (r, c).

        >>> one = np.array([0, 2]), np.array([[1.0, 2.0], [2.0, 3.0]])
        >>> other = np.array([2]), np.array([[10.0]])
        >>> BlockSum.of(3, [one, other]).part(np.array([2, 1]), np.array([0, 1, 2]))
        array([[ 2.,  0., 13.],
               [ 0.,  0.,  0.]])
        """
        if len(self.blocks) == 1 and len(self.blocks[0][0]) == self.size:
            (_, values), place = self.blocks[0], self.places[0]
            whole: Array = values[place[rows][:, None], place[columns]]
            return whole
        out = np.zeros((len(rows), len(columns)))
        for (_, values), place in zip(self.blocks, self.places, strict=True):
            here = place[rows]
            there = here if rows is columns else place[columns]
            i = np.flatnonzero(here >= 0)
            j = i if rows is columns else np.flatnonzero(there >= 0)
            if i.size and j.size:
                out[i[:, None], j] += values[here[i][:, None], there[j]]
        return out

    def rows(self, rows: Index) -> Array:
        """Some whole rows, (r, k)."""
        out = np.zeros((len(rows), self.size))
        for (at, values), place in zip(self.blocks, self.places, strict=True):
            here = place[rows]
            i = np.flatnonzero(here >= 0)
            out[i[:, None], at] += values[here[i]]
        return out

    def diagonal_parts(self, at: Index) -> Array:
        """The parts of m selections of k rows and columns each, (m, k) to (m, k, k)."""
        out = np.zeros((*at.shape, at.shape[1]))
        for (_, values), place in zip(self.blocks, self.places, strict=True):
            local = place[at]
            some = np.flatnonzero((local >= 0).any(axis=1))
            if some.size:
                own, inside = local[some], local[some] >= 0
                found = values[own[:, :, None], own[:, None, :]]
                out[some] += np.where(inside[:, :, None] & inside[:, None], found, 0.0)
        return out

    def select(self, at: Index) -> BlockSum:
        """The matrix of some rows and columns (c,), in one block."""
        return BlockSum.of(len(at), [(np.arange(len(at)), self.part(at, at))])
