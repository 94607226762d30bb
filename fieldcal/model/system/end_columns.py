"""Columns that change the inputs in positions, and with them the ends of turns.

The positions are changed once for all turns, by a step up and down of each column. A
turn uses the two positions at its ends. The closure phi_T of `turn` is not linear in
them, so its derivative is a central difference.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model.causes.basis import General, RowView
from fieldcal.model.state import State
from fieldcal.model.turns.attitude import (
    closures,
    first_row_of_each,
    interpolate_vectors,
)
from fieldcal.model.turns.turn import Turn
from fieldcal.physics.experience import Experience
from fieldcal.physics.experience_rows import select_rows


class TurnEnds(NamedTuple):
    """Inputs in some positions, or at the two ends of a turn.

    Attributes
    ----------
    f, w : (..., 3) force and rate in device axes
    held : (..., 3, 3) direction cosines from base to device; nan where unknown

    """

    f: Array
    w: Array
    held: Array

    @classmethod
    def of(cls, x: Experience) -> TurnEnds:
        """Inputs of rows, (n, ...)."""
        return cls(x.f, x.w, x.to_device)

    @classmethod
    def stacked(cls, ends: Iterable[TurnEnds]) -> TurnEnds:
        """Stack several inputs of the same positions, (k, n, ...)."""
        return cls(*map(np.stack, zip(*ends, strict=True)))

    @classmethod
    def concatenated(cls, ends: Iterable[TurnEnds]) -> TurnEnds:
        """Concatenate along the first axis."""
        return cls(*map(np.concatenate, zip(*ends, strict=True)))

    def at(self, *place: Any) -> TurnEnds:
        """Some of the positions, by index."""
        return TurnEnds(*(values[place] for values in self))

    def with_end(self, here: int, other: TurnEnds) -> TurnEnds:
        """Both ends (2, ...), k times, with end `here` from `other` (k, ...)."""
        parts = [np.repeat(own[None], len(other.f), axis=0) for own in self]
        for part, new in zip(parts, other, strict=True):
            part[:, here] = new
        return TurnEnds(*parts)


@dataclass(frozen=True, slots=True)
class EndColumns:
    """Columns of one basis, a step up and down in every position.

    Attributes
    ----------
    first : of the dictionary
    places : (p,) positions; each has columns of its own if `each`
    base : in these positions, without a step
    up, down, step : (k, p, ...) and (k,)

    """

    first: int
    places: Index
    each: bool
    base: TurnEnds
    up: TurnEnds
    down: TurnEnds
    step: Array

    @classmethod
    def of(cls, first: int, one: General, places: RowView) -> EndColumns:
        """Evaluate a basis with `sides` in some positions, by `positions_about`."""
        if one.sides is None:
            raise ValueError(f"{one.name} changes nothing in positions")
        ups, downs, steps = zip(*one.sides(places), strict=True)
        return cls(
            first, places.nominal.position, one.per_position, TurnEnds.of(places.x),
            TurnEnds.stacked(map(TurnEnds.of, ups)),
            TurnEnds.stacked(map(TurnEnds.of, downs)), np.array(steps),
        )  # fmt: skip

    def columns_for(self, turn: Turn, scale: Array) -> tuple[Index, Array, Array]:
        """Columns (k,) of a turn, with derivatives of its outputs and of its closure.

        Derivatives of the outputs at the turn's edges are (m + 1, 6, k), for scale
        factors `scale` (6,); those of the closure (3, k), rad.
        """
        columns, up, down, step = self._at(np.searchsorted(self.places, turn.positions))
        f, w = ((a - b) / (2 * step[:, None, None])
                for a, b in ((up.f, down.f), (up.w, down.w)))  # fmt: skip
        each = [
            interpolate_vectors(turn.attitude, turn.done, *np.moveaxis(v, 0, 2))
            for v in (f, w)
        ]
        outputs = np.concatenate(each, axis=1)
        end = turn.attitude[-1]
        one, other = (closures(x.f, x.held, end)[0] for x in (up, down))
        moved = ((one - other) / (2 * step[:, None])).T
        return columns, outputs * scale[:, None], moved

    def _at(self, ends: Index) -> tuple[Index, TurnEnds, TurnEnds, Array]:
        """Columns, both ends with each of them up and down, (k, 2, ...), and steps."""
        count = len(self.step)
        if not self.each:
            at = slice(None), ends
            columns = self.first + np.arange(count)
            return columns, self.up.at(*at), self.down.at(*at), self.step
        base = self.base.at(ends)
        columns = self.first + count * self.places[ends][:, None] + np.arange(count)
        up, down = (
            TurnEnds.concatenated(
                base.with_end(i, some.at(slice(None), p)) for i, p in enumerate(ends)
            )
            for some in (self.up, self.down)
        )
        return columns.ravel(), up, down, np.tile(self.step, 2)


def positions_about(x: Experience, state: State) -> RowView:
    """The positions of windows, by the first of their rows `x`, about a state."""
    first = first_row_of_each(x, np.unique(x.position))
    plain = select_rows(x, first.tolist())
    return RowView.of(plain, plain.since_turn[None], state)
