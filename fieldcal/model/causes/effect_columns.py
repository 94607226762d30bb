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
    Separable,
)
from fieldcal.physics.experience import Experience

DERIVATIVE_STEP = 1e-3
"""Step of numerical derivatives, in typical sizes."""


def effect_basis(effect: Effect, shape: Mapping[str, float], origin: int) -> General:
    """Columns of an effect of the catalogue."""

    def sensor(view: RowView) -> Array:
        inputs = view.with_origin(origin)
        design: Array = effect.design(inputs, shape or NO_SHAPE)  # type: ignore[attr-defined]
        return design * effect.gain(view.state.scale)[:, None]  # type: ignore[attr-defined]

    def sides(plain: Experience, state: State) -> Iterator[CentralDifference]:
        turned = state.turned(plain)
        for j, param in enumerate(effect.params):
            step = np.zeros(len(effect.params))
            step[j] = DERIVATIVE_STEP * param.typical
            up, down = (
                _with_changed_parameters(turned, state, effect, s)
                for s in (step, -step)
            )
            yield up, down, float(step[j])

    def on_the_way(view: RowView) -> Array:
        columns = []
        for j, param in enumerate(effect.params):
            step = np.zeros(len(effect.params))
            step[j] = DERIVATIVE_STEP * param.typical
            ends = [effect.change(view.x, s) for s in (step, -step)]  # type: ignore[attr-defined]
            columns.append(
                output_derivative(ends[0], ends[1], float(step[j]), view.state)
            )
        return np.stack(columns, axis=2)

    if isinstance(effect, Motion):
        if effect.on_the_way:
            return General(effect.id, on_the_way)
        return General(effect.id, central_differences(sides), sides=sides)
    return General(effect.id, sensor)


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
            pattern = effect.pattern(inputs)
            courses = [effect.course(inputs, shape or NO_SHAPE) for shape, _ in points]
            product = pattern[:, :, None] * np.stack(courses, axis=1)[:, None, :, None]
            parts.append(product.reshape(len(view.x), 6, -1))
        gain = effect.gain(view.state.scale)[:, None]
        columns: Array = np.concatenate(parts, axis=2) * gain
        return columns

    return General(effect.id, of)


def _with_changed_parameters(
    turned: Experience, state: State, effect: Effect, more: Array
) -> Experience:
    """Inputs with the parameters of a motion effect changed by `more`.

    `turned` are those without motion effects.
    """
    present = [t.values for t in state.terms if t.effect is effect]
    rest = tuple(t for t in state.terms if t.effect is not effect)
    term = Term(effect, sum(present, np.zeros(len(more))) + more)
    return replace(state, terms=(*rest, term)).moved(turned)
