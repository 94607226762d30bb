"""Columns that change the inputs in positions, and with them the ends of turns.

The positions are changed once for all turns, by a step up and down of each column. A
turn uses the two positions at its ends. The closure phi_T of `turn` is not linear in
them, so its derivative is a central difference. What changes at both ends is carried
along the turn as `attitude.interpolate_vectors` does it, (t,) turns at once.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model.causes.basis import General, RowView
from fieldcal.model.state import State
from fieldcal.model.turns.attitude import closures, first_row_of_each
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
        """Both ends of t turns (t, 2, ...), k times, with one from `other` (k, t, ...).

        `here` is the number of that end.
        """
        parts = [np.repeat(own[None], len(other.f), axis=0) for own in self]
        for part, new in zip(parts, other, strict=True):
            part[:, :, here] = new
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

    def columns_of(
        self, turns: Sequence[Turn], scale: Array
    ) -> list[tuple[Index, Array, Array]]:
        """Columns (k,) of each turn, with derivatives of its outputs and its closure.

        Derivatives of the outputs at a turn's edges are (m + 1, 6, k), for scale
        factors `scale` (6,); those of the closure (3, k), rad.
        """
        ends = np.searchsorted(self.places, [turn.positions for turn in turns])
        columns, up, down, step = self._at(ends)
        last = np.stack([turn.attitude[-1] for turn in turns])
        f, w = ((a - b) / (2 * step[:, None, None, None])
                for a, b in ((up.f, down.f), (up.w, down.w)))  # fmt: skip
        # (t, 2, 3, 2 k): both triads turn alike
        changes = np.moveaxis(np.concatenate([f, w]), 0, 3)
        cut = np.cumsum([len(turn.done) for turn in turns])
        number = np.repeat(np.arange(len(turns)), np.diff(cut, prepend=0))
        attitude = np.concatenate([turn.attitude for turn in turns])
        part = np.concatenate([turn.done for turn in turns])[:, None, None]
        start, end = changes[:, 0], np.swapaxes(last, 1, 2) @ changes[:, 1]
        seen = attitude @ (start[number] + part * (end - start)[number])
        count = len(step)
        outputs = np.concatenate([seen[..., :count], seen[..., count:]], axis=1)
        one, other = (
            closures(
                x.f.reshape(-1, 2, 3), x.held.reshape(-1, 2, 3, 3),
                np.tile(last, (count, 1, 1)),
            )[0].reshape(count, -1, 3)
            for x in (up, down)
        )  # fmt: skip
        moved = np.moveaxis((one - other) / (2 * step[:, None, None]), 0, 2)
        each = np.split(outputs * scale[:, None], cut[:-1])
        return list(zip(columns, each, moved, strict=True))

    def _at(self, ends: Index) -> tuple[Index, TurnEnds, TurnEnds, Array]:
        """Columns (t, k), the ends (t, 2) with each up and down, (k, t, ...), steps."""
        count = len(self.step)
        if not self.each:
            at = slice(None), ends
            columns = self.first + np.tile(np.arange(count), (len(ends), 1))
            return columns, self.up.at(*at), self.down.at(*at), self.step
        base = self.base.at(ends)
        columns = self.first + count * self.places[ends][..., None] + np.arange(count)
        up, down = (
            TurnEnds.concatenated(
                base.with_end(i, some.at(slice(None), ends[:, i])) for i in range(2)
            )
            for some in (self.up, self.down)
        )
        return columns.reshape(len(ends), -1), up, down, np.tile(self.step, 2)


def positions_about(x: Experience, state: State) -> RowView:
    """The positions of windows, by the first of their rows `x`, about a state."""
    first = first_row_of_each(x, np.unique(x.position))
    plain = select_rows(x, first.tolist())
    return RowView.of(plain, plain.since_turn[None], state)
