"""Columns of the effects of the catalogue, by their own equations.

Those of an effect that adds to the outputs are its `design`. Those of an effect that
changes the inputs are central differences.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from operator import itemgetter

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model import tolerances
from fieldcal.model.causes.basis import (
    CentralDifference,
    Course,
    General,
    RowView,
    central_differences,
    output_derivative,
)
from fieldcal.model.state import State, Term
from fieldcal.physics.effect import (
    NO_SHAPE,
    BiasChange,
    Effect,
    Motion,
    Sensor,
    Separable,
)
from fieldcal.physics.experience import Experience


def effect_basis(effect: Effect, shape: Mapping[str, float], origin: int) -> General:
    """Columns of an effect of the catalogue.

    Raises
    ------
    TypeError
        If the effect has no equation.

    """
    if isinstance(effect, Sensor):
        return _sensor_basis(effect, shape, origin)
    if isinstance(effect, Motion):
        return _motion_basis(effect)
    raise TypeError(f"{effect.id} has no equation")


def _sensor_basis(effect: Sensor, shape: Mapping[str, float], origin: int) -> General:
    def of(view: RowView) -> Array:
        design = effect.design(view.with_origin(origin), shape or NO_SHAPE)
        return _with_gain(effect, design, view)

    return General(effect.id, of)


def _motion_basis(effect: Motion) -> General:
    def steps() -> Iterator[Array]:
        for j, param in enumerate(effect.params):
            step = np.zeros(len(effect.params))
            step[j] = tolerances.DERIVATIVE_STEP * param.typical
            yield step

    def sides(view: RowView) -> Iterator[CentralDifference]:
        for step in steps():
            ends = (step, -step)
            up, down = (_changed(view.turned, view.state, effect, s) for s in ends)
            yield up, down, float(step.max())

    def on_the_way(view: RowView) -> Array:
        columns = []
        for step in steps():
            up, down = (effect.change(view.x, s) for s in (step, -step))
            columns.append(output_derivative(up, down, float(step.max()), view.state))
        return np.stack(columns, axis=2)

    if effect.on_the_way:
        return General(effect.id, on_the_way)
    return General(effect.id, central_differences(sides), sides=sides)


def bias_change_basis(
    effect: BiasChange, grid: Sequence[tuple[Mapping[str, float], int]]
) -> Course:
    """Courses of an effect that adds one function to every output, by grid point."""

    def of(view: RowView) -> Array:
        courses = []
        for shape, origin in grid:
            inputs = view.with_origin(origin)
            courses.append(effect.course(inputs, shape or NO_SHAPE))
        return np.stack(courses, axis=1)

    return Course(effect.id, of, len(grid), True)


def separable_basis(
    effect: Separable, grid: Sequence[tuple[Mapping[str, float], int]]
) -> General:
    """Columns of a separable effect: pattern times course, for each grid point."""

    def of(view: RowView) -> Array:
        parts = []
        for origin, points in groupby(grid, key=itemgetter(1)):
            inputs = view.with_origin(origin)
            pattern = _with_gain(effect, effect.pattern(inputs), view)
            courses = [effect.course(inputs, shape or NO_SHAPE) for shape, _ in points]
            product = pattern[:, :, None] * np.stack(courses, axis=1)[:, None, :, None]
            parts.append(product.reshape(len(view.x), 6, -1))
        return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=2)

    return General(effect.id, of)


def _with_gain(effect: Sensor, design: Array, view: RowView) -> Array:
    """Columns (n, 6, k) by a design of an effect; the design itself if these are it."""
    if not effect.of_inputs:
        return design
    return design * effect.gain(view.state.scale)[:, None]


def _changed(
    turned: Experience, state: State, effect: Effect, more: Array
) -> Experience:
    """Inputs with the parameters of a motion effect changed by `more`.

    `turned` are those without motion effects.
    """
    present = [t.values for t in state.terms if t.effect is effect]
    rest = tuple(t for t in state.terms if t.effect is not effect)
    term = Term(effect, sum(present, np.zeros(len(more))) + more)
    return replace(state, terms=(*rest, term)).moved(turned)
