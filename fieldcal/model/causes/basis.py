"""A basis: some columns of one form, and the rows at which they are evaluated.

A `Course` is a function of the row, with one column for each channel. All other columns
are `General`. Windows and turns use the same objects, with the inputs of the device in
each.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model.state import State
from fieldcal.physics.effect import NO_SHAPE, BiasChange, Sensor, outputs_at
from fieldcal.physics.experience import Experience

CentralDifference = tuple[Experience, Experience, float]

Sides = Callable[["RowView"], Iterator[CentralDifference]]
"""Inputs for each of some parameters, a step up and a step down, and the step."""


@dataclass(frozen=True, slots=True)
class RowView:
    """Rows at which columns are evaluated.

    Attributes
    ----------
    nominal : inputs of the device without the state's rotations and motion effects
    x : inputs of the device with them
    since : (o, n) s since the turn, by origin of the time
    state : the base state
    differences : columns that were calculated as central differences, by their sides

    """

    nominal: Experience
    x: Experience
    since: Array
    state: State
    # caches; not passed on to copies, which may have other inputs
    _by_origin: dict[int, Experience] = field(
        default_factory=dict, init=False, repr=False
    )
    _rotated: list[Experience] = field(default_factory=list, init=False, repr=False)
    _turned: list[Experience] = field(default_factory=list, init=False, repr=False)
    differences: dict[Sides, Array] = field(
        default_factory=dict, init=False, repr=False
    )

    @classmethod
    def of(cls, plain: Experience, since: Array, state: State) -> RowView:
        """Rows at a base state."""
        return cls(plain, state.experienced(plain), since, state)

    @property
    def rotated(self) -> Experience:
        """Inputs with the state's small rotations alone."""
        if not self._rotated:
            self._rotated.append(self.state.rotated(self.nominal))
        return self._rotated[0]

    @property
    def turned(self) -> Experience:
        """Inputs with the state's small rotations and the Earth's rate alone."""
        if not self._turned:
            self._turned.append(self.state.with_earth(self.rotated))
        return self._turned[0]

    def with_origin(self, origin: int) -> Experience:
        """Inputs whose time since the turn counts from one origin."""
        if origin not in self._by_origin:
            since_origin = replace(self.x, since_turn=self.since[origin])
            self._by_origin[origin] = since_origin
        return self._by_origin[origin]


@dataclass(frozen=True, slots=True)
class Course:
    """A function of the row alone, (n, m), on every channel: 6 m columns.

    n rows, m functions. `timed` states that the function is also known during turns;
    `while_output_stands` that it acts during a turn only while a gyroscope output keeps
    the value that it has in the windows.
    """

    name: str
    evaluate: Callable[[RowView], Array]
    width: int
    timed: bool = False
    while_output_stands: bool = False


@dataclass(frozen=True, slots=True)
class General:
    """Columns (n, 6, k) of any form.

    Attributes
    ----------
    name : of the basis
    evaluate : calculates the columns
    sides : if it changes the inputs of the device: yields, for each column, the inputs
        for a parameter one step up and one step down, and the step
    per_position : whether every position has columns of its own, in sequence; `sides`
        then changes all positions at once
    needs_whole_turn : whether its value in a row of a turn depends on neighbouring rows

    """

    name: str
    evaluate: Callable[[RowView], Array]
    sides: Sides | None = None
    per_position: bool = False
    needs_whole_turn: bool = False


def central_differences(sides: Sides) -> Callable[[RowView], Array]:
    """Columns as central differences over the inputs; calculated once for some rows."""

    def of(view: RowView) -> Array:
        if sides not in view.differences:
            columns = [
                output_derivative(up, down, step, view.state)
                for up, down, step in sides(view)
            ]
            view.differences[sides] = np.stack(columns, axis=2)
        return view.differences[sides]

    return of


def output_derivative(
    up: Experience, down: Experience, step: float, state: State
) -> Array:
    """Derivative of the outputs (n, 6) as a central difference.

    `up` and `down` are the inputs for a parameter one `step` higher and lower.
    """
    change: Array = np.hstack([up.f - down.f, up.w - down.w]) * state.scale
    for term in state.terms:
        # a change of a bias is the same for all inputs
        if isinstance(term.effect, Sensor) and not isinstance(term.effect, BiasChange):
            shape = term.shape or NO_SHAPE
            ends = (term.effect.design(x, shape) for x in (up, down))
            at_up, at_down = (outputs_at(design, term.values) for design in ends)
            change = change + (at_up - at_down) * term.effect.gain(state.scale)
    return change / (2 * step)
