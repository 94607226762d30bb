"""Causes from effects of the catalogue that have an equation, and their columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from itertools import combinations, product

import numpy as np

from fieldcal.core.gravity import G0
from fieldcal.core.samples import ACC, CHANNELS, GYR, Array, Index, Mask
from fieldcal.effects import catalogue
from fieldcal.model.causes.cause import TRIADS, Cause, Group, Point
from fieldcal.model.causes.column_table import ColumnTable
from fieldcal.model.causes.effect_columns import (
    bias_change_basis,
    effect_basis,
    separable_basis,
)
from fieldcal.physics.effect import (
    NO_SHAPE,
    BiasChange,
    Effect,
    Motion,
    Sensor,
    Separable,
)
from fieldcal.physics.experience import Experience
from fieldcal.physics.joint_turns import JointTurns

NO_POINT: Point = (NO_SHAPE, 0)
"""The only grid point of an effect without shape parameters."""


def effect_causes(table: ColumnTable) -> Iterator[Cause]:
    """Causes of every effect of the catalogue that applies to the session."""
    for effect in catalogue().values():
        if not isinstance(effect, Motion | Sensor) or not effect.params:
            continue
        if effect.applies(table.measured) and (
            grid := list(shape_points(table, effect))
        ):
            yield from _causes_of_effect(table, effect, grid)


def _causes_of_effect(
    table: ColumnTable, effect: Motion | Sensor, grid: Sequence[Point]
) -> Iterator[Cause]:
    """Causes of an effect: one, or one for each triad."""
    places = effect_columns(table, effect, grid)
    for part, at in parameter_groups(table, effect):
        variants = tuple(
            _group(table, effect, part, params, point, columns)
            for params in _parameter_subsets(table, effect, at)
            for point, columns in zip(grid, places, strict=True)
        )
        if variants:
            yield Cause(effect.id, part, effect.chance(table.x), variants)


def effect_group(
    table: ColumnTable, name: str, turned: bool, point: Point = NO_POINT
) -> Group:
    """Group of an effect of the catalogue with all its parameters, of typical size.

    If the device is `turned` by an unknown rotation, the parameters that such a
    rotation cannot distinguish from others are omitted (`Effect.turned_into`). `point`
    is the grid point of its shape, if it has one.

    Raises
    ------
    TypeError
        If the effect has no equation.

    """
    effect = catalogue()[name]
    if not isinstance(effect, Motion | Sensor):
        raise TypeError(f"{name} has no equation")
    params = [j for j, p in enumerate(effect.params)
            if not (turned and p.name in effect.turned_into)]  # fmt: skip
    at = effect_columns(table, effect, [point])[0][params]
    typical = np.array([effect.params[j].typical for j in params])
    size = typical * units_of(table, effect)[params]
    return Group(
        name, "", at, size, effect, *point, params=tuple(params), in_state=True
    )


def groups_at_points(
    table: ColumnTable, group: Group, grid: Sequence[Point]
) -> list[Group]:
    """A group at other grid points of its shape, with new columns."""
    effect = group.effect
    if not isinstance(effect, Motion | Sensor) or not grid:
        return []
    return [
        _group(table, effect, group.part, group.params, point, at)
        for point, at in zip(grid, effect_columns(table, effect, grid), strict=True)
    ]


def _group(
    table: ColumnTable,
    effect: Effect,
    part: str,
    params: tuple[int, ...],
    point: Point,
    at: Index,
) -> Group:
    """Group of some parameters of an effect at one grid point."""
    typical = np.array([p.typical for p in effect.params]) * units_of(table, effect)
    shape, origin = point
    return Group(
        effect.id, part, at[list(params)], typical[list(params)], effect, shape, origin,
        params, in_state=True,
    )  # fmt: skip


def effect_columns(
    table: ColumnTable, effect: Motion | Sensor, grid: Sequence[Point]
) -> list[Index]:
    """Append the columns of an effect; indices (k,) for each grid point."""
    count = len(effect.params)
    if isinstance(effect, BiasChange):
        at = table.add(bias_change_basis(effect, grid), 6 * len(grid))
        channel = [CHANNELS.index(p.name) for p in effect.params]
        return list(at.reshape(6, len(grid))[channel].T)
    if isinstance(effect, Separable):
        at = table.add(separable_basis(effect, grid), count * len(grid))
        return list(at.reshape(len(grid), count))
    return [table.add(effect_basis(effect, *point), count) for point in grid]


def parameter_groups(
    table: ColumnTable, effect: Effect
) -> list[tuple[str, tuple[int, ...]]]:
    """Parts and parameter indices of an effect.

    One part for each triad if its parameters are named after channels; else one, "".
    """
    names = [p.name for p in effect.params]
    if not set(names) <= set(CHANNELS):
        return [("", tuple(range(len(names))))]
    observed = {CHANNELS[c] for c in table.observed}
    return [
        (part, tuple(j for j, n in enumerate(names)
                     if CHANNELS.index(n) in at and n in observed))
        for part, at in TRIADS
    ]  # fmt: skip


def _parameter_subsets(
    table: ColumnTable, effect: Motion | Sensor, at: tuple[int, ...]
) -> list[tuple[int, ...]]:
    """Subsets of parameters that form variants: all, or those of one or two outputs.

    A vector has one component or all. `at` are the indices of the parameters of one
    part.
    """
    if isinstance(effect, Motion) or not at:
        return [at] if at else []
    if effect.one_vector:
        return [at, *((j,) for j in at)]
    reach = np.abs(effect.design(table.x, _any_shape(effect))).max(axis=0)[:, at]
    of_output = [tuple(np.array(at)[reach[c] > 0].tolist()) for c in range(6)]
    of_output = [subset for subset in of_output if subset and subset != at]
    of_two = [tuple(sorted(set(a + b))) for a, b in combinations(of_output, 2)]
    subsets = [*of_output, *([] if effect.shapes else of_two)]
    return [at, *(subset for subset in dict.fromkeys(subsets) if subset != at)]


def units_of(table: ColumnTable, effect: Effect) -> Array:
    """Outputs per SI unit for each parameter, (k,); 1 for what changes inputs.

    The outputs are those that the parameter changes; accelerometers, if it changes both
    triads.
    """
    if not isinstance(effect, Sensor) or effect.of_inputs:
        return np.ones(len(effect.params))
    gyro = _changes_gyroscopes_only(effect)
    out: Array = np.abs(np.where(gyro, table.unit[3], table.unit[0]))
    return out


@cache
def _changes_gyroscopes_only(effect: Sensor) -> Mask:
    """Parameters that change outputs of gyroscopes and none of accelerometers, (k,)."""
    reach = np.abs(effect.design(_rows_in_motion(), _any_shape(effect))).max(axis=0)
    out: Mask = (reach[GYR].max(axis=0) > 0) & (reach[ACC].max(axis=0) == 0)
    return out


@cache
def _rows_in_motion() -> Experience:
    """Two rows in which every sensor effect changes some output."""
    six, two = np.linspace(1.0, 2.0, 12).reshape(2, 6), np.array([1.0, 2.0])
    held = Experience.at_rest(
        0.1 * two, 0.2 * two, G0, w_dot=six[::-1, ACC], f_dot=six[::-1, GYR],
        slope=six, bend=six, missed=six, f_bend=six[:, ACC], w_bend=six[:, GYR],
        passed=six,
        variance=six[:, ACC],
        warming=two, heating=two, t=two, since_start=two, since_turn=two,
        position=np.arange(2),
        joint_turns=JointTurns.of(two - 0.5, np.outer(two, [0.1, 0.2, 0.3])),
    )  # fmt: skip
    return replace(held, w=six[:, GYR])


def shape_points(table: ColumnTable, effect: Effect) -> Iterator[Point]:
    """Grid points of an effect: shape parameters, with the origin of times."""
    x, since = table.measured, table.measured_since
    grids = [shape.grid(x, since) for shape in effect.shapes]
    names = [shape.name for shape in effect.shapes]
    for point in product(*grids):
        values = dict(zip(names, (value for value, _ in point), strict=True))
        yield values, max((origin for _, origin in point), default=0)


def _any_shape(effect: Effect) -> dict[str, float]:
    """An arbitrary shape, to find the outputs that an effect changes."""
    return {
        s.name: max(s.low, 1.0) if np.isfinite(s.low) else 0.0 for s in effect.shapes
    }
