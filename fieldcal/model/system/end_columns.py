"""Columns that change what is experienced in positions, as the turns between meet them.

The positions are changed once for all turns, by a step up and down of each column; of
that a turn has its two ends. The closure phi_T of `turn` is linear in neither of them,
so it moves by the difference of its values at both steps.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model.causes.columns import General
from fieldcal.model.state import State
from fieldcal.model.turns.attitude import between, closures, rows_of
from fieldcal.model.turns.turn import Turn, only
from fieldcal.physics.experience import Experience


@dataclass(frozen=True, slots=True)
class Ends:
    """What is experienced in some positions or, of a turn, at its ends.

    Attributes
    ----------
    f, w : (..., 3) force and rate in device axes
    held : (..., 3, 3) direction cosines from base to device; nan where unknown

    """

    f: Array
    w: Array
    held: Array

    @classmethod
    def of(cls, x: Experience) -> Ends:
        """Of rows, (n, ...)."""
        return cls(x.f, x.w, x.to_device)

    @classmethod
    def stacked(cls, some: list[Ends]) -> Ends:
        """Several of the same positions, (k, n, ...)."""
        return cls(
            *(np.stack([getattr(e, n) for e in some]) for n in ("f", "w", "held"))
        )

    def at(self, *place: object) -> Ends:
        """Some of them."""
        return Ends(self.f[place], self.w[place], self.held[place])  # type: ignore[index]

    def with_end(self, here: int, other: Ends) -> Ends:
        """Both ends (2, ...) k times, one of them replaced by k others (k, ...)."""
        parts = []
        for name in ("f", "w", "held"):
            own, new = getattr(self, name), getattr(other, name)
            both = np.repeat(own[None], len(new), axis=0)
            both[:, here] = new
            parts.append(both)
        return Ends(*parts)


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
    base: Ends
    up: Ends
    down: Ends
    step: Array

    @classmethod
    def of(cls, first: int, one: General, x: Experience, state: State) -> EndColumns:
        """Of a basis with `sides`; `x` are the windows' rows."""
        if one.sides is None:
            raise ValueError(f"{one.name} changes nothing in positions")
        places = np.unique(x.position)
        plain = only(x, rows_of(x, places).tolist())
        ups, downs, steps = zip(*one.sides(plain, state), strict=True)
        return cls(
            first, places, one.each, Ends.of(state.experienced(plain)),
            Ends.stacked([Ends.of(x) for x in ups]),
            Ends.stacked([Ends.of(x) for x in downs]), np.array(steps),
        )  # fmt: skip

    def met_by(self, turn: Turn, scale: Array) -> tuple[Index, Array, Array]:
        """Columns (k,) that a turn meets, their outputs, and how the closure moves.

        Outputs (m + 1, 6, k) are those at the edges of the turn, for scale factors
        (6,); the closure (3, k) moves by its own units.
        """
        columns, up, down, step = self._at(np.searchsorted(self.places, turn.positions))
        f, w = ((a - b) / (2 * step[:, None, None])
                for a, b in ((up.f, down.f), (up.w, down.w)))  # fmt: skip
        outputs = np.concatenate(
            [between(turn.attitude, turn.done, *np.moveaxis(v, 0, 2)) for v in (f, w)],
            axis=1,
        )
        end = turn.attitude[-1]
        one, other = (closures(x.f, x.held, end)[0] for x in (up, down))
        moved = ((one - other) / (2 * step[:, None])).T
        return columns, outputs * scale[:, None], moved

    def _at(self, ends: Index) -> tuple[Index, Ends, Ends, Array]:
        """Columns, both ends with each of them up and down, (k, 2, ...), and steps."""
        count = len(self.step)
        if not self.each:
            at = slice(None), ends
            columns = self.first + np.arange(count)
            return columns, self.up.at(*at), self.down.at(*at), self.step
        base = self.base.at(ends)
        columns = self.first + count * self.places[ends][:, None] + np.arange(count)
        up, down = (
            _joined(
                base.with_end(i, some.at(slice(None), p)) for i, p in enumerate(ends)
            )
            for some in (self.up, self.down)
        )
        return columns.ravel(), up, down, np.tile(self.step, 2)


def _joined(parts: Iterator[Ends]) -> Ends:
    """One after the other."""
    some = list(parts)
    return Ends(
        *(np.concatenate([getattr(e, n) for e in some]) for n in ("f", "w", "held"))
    )
