"""Causes from effects of the catalogue that have an equation, and their columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from fieldcal.core.factory import WARM_UP_S, WARMING, FactoryErrors
from fieldcal.core.samples import CHANNELS, Array, Index
from fieldcal.effects import catalogue
from fieldcal.model.causes import columns
from fieldcal.model.causes.cause import TRIADS, Cause, Group, Point
from fieldcal.model.causes.column_table import ColumnTable
from fieldcal.model.causes.hysteresis import hysteresis
from fieldcal.physics.effect import (
    NO_SHAPE,
    BiasChange,
    Effect,
    Motion,
    Sensor,
    Separable,
)
from fieldcal.physics.experience import Experience

NOWHERE: Point = (NO_SHAPE, 0)
"""The only point of an effect that has no shape."""


def of_effects(table: ColumnTable) -> Iterator[Cause]:
    """Every effect of the catalogue that has columns here."""
    for effect in catalogue().values():
        if not isinstance(effect, Motion | Sensor) or not effect.params:
            continue
        if effect.applies(table.x) and (grid := list(points(table, effect))):
            yield from _of_effect(table, effect, grid)


def _of_effect(
    table: ColumnTable, effect: Motion | Sensor, grid: Sequence[Point]
) -> Iterator[Cause]:
    """The causes that an effect is: one, or one a triad."""
    places = effect_columns(table, effect, grid)
    for part, at in parts(table, effect):
        variants = tuple(
            _group(table, effect, part, some, point, columns)
            for some in _axes(table, effect, at)
            for point, columns in zip(grid, places, strict=True)
        )
        if variants:
            yield Cause(effect.id, part, effect.chance(table.x), variants)


def whole(table: ColumnTable, name: str, turned: bool, point: Point = NOWHERE) -> Group:
    """An effect of the catalogue with its parameters, of typical size.

    Those that a turn of the whole device makes of others are left out if it is `turned`
    as nobody knows. `point` is its shape, if it has one.

    Raises
    ------
    TypeError
        If the effect has no equation.

    """
    effect = catalogue()[name]
    if not isinstance(effect, Motion | Sensor):
        raise TypeError(f"{name} has no equation")
    some = [j for j, p in enumerate(effect.params)
            if not (turned and p.name in effect.turned_into)]  # fmt: skip
    at = effect_columns(table, effect, [point])[0][some]
    typical = np.array([effect.params[j].typical for j in some])
    size = typical * units_of(table, effect)[some]
    return Group(name, "", at, size, effect, *point, params=tuple(some), in_state=True)


def of_size(
    table: ColumnTable,
    name: str,
    size: Array,
    turned: bool,
    point: Point = NOWHERE,
) -> Group:
    """The same as what a factory left, whose coefficients have a known size, SI."""
    one = whole(table, name, turned, point)
    wide = (size * units_of(table, catalogue()[name]))[list(one.params)]
    return replace(one, cause="factory", part=name, typical=wide, fixed=1.0)


def of_factory(table: ColumnTable, left: FactoryErrors, turned: bool) -> list[Group]:
    """What a factory left of errors that are not estimated.

    Biases follow a thermometer if one shows a change, and the warm-up of a package
    otherwise.
    """
    if not table.x.f.any():
        return []
    shapes = {WARMING[1]: {"tau_s": WARM_UP_S}}
    return [
        hysteresis(table, float(size[0]))
        if name == "hysteresis"
        else of_size(table, name, size, turned, (shapes.get(name, {}), 0))
        for name, size in factory_sizes(table.x, left).items()
        if size.any()
    ]


def factory_sizes(x: Experience, left: FactoryErrors) -> dict[str, Array]:
    """One sigma of each effect that a factory left, SI: one for all, or (6,)."""
    sizes = {name: np.array([size]) for name, size in left.by_effect.items()}
    sizes["hysteresis"] = np.array([left.hysteresis])
    name, per_k = left.warming(x.warms)
    return sizes | {name: np.array(per_k)}


def at_points(table: ColumnTable, group: Group, grid: Sequence[Point]) -> list[Group]:
    """The group of an effect at other points of its shape, with columns of its own."""
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
    some: tuple[int, ...],
    point: Point,
    at: Index,
) -> Group:
    """Some parameters of an effect at one point of its grid."""
    every = np.array([p.typical for p in effect.params]) * units_of(table, effect)
    shape, origin = point
    return Group(
        effect.id, part, at[list(some)], every[list(some)], effect, shape, origin, some,
        in_state=True,
    )  # fmt: skip


def effect_columns(
    table: ColumnTable, effect: Motion | Sensor, grid: Sequence[Point]
) -> list[Index]:
    """Append the columns of an effect: those of its parameters, for each point."""
    count = len(effect.params)
    if isinstance(effect, BiasChange):
        course = columns.of_channels(effect, grid)
        start = table.add(course, 6 * len(grid))
        channel = np.array([CHANNELS.index(p.name) for p in effect.params])
        return [start + channel * len(grid) + i for i in range(len(grid))]
    if isinstance(effect, Separable):
        start = table.add(columns.of_courses(effect, grid), count * len(grid))
        return [start + i * count + np.arange(count) for i in range(len(grid))]
    return [
        table.add(columns.of_effect(effect, *point), count) + np.arange(count)
        for point in grid
    ]


def parts(table: ColumnTable, effect: Effect) -> list[tuple[str, tuple[int, ...]]]:
    """Parameters that go together: those of a triad, where they are by channel."""
    names = [p.name for p in effect.params]
    if not set(names) <= set(CHANNELS):
        return [("", tuple(range(len(names))))]
    seen = {CHANNELS[c] for c in table.observed}
    return [
        (part, tuple(j for j, n in enumerate(names)
                     if CHANNELS.index(n) in at and n in seen))
        for part, at in TRIADS
    ]  # fmt: skip


def _axes(
    table: ColumnTable, effect: Motion | Sensor, at: tuple[int, ...]
) -> list[tuple[int, ...]]:
    """Parameters that go together: all, or those of one output or of two alone."""
    if isinstance(effect, Motion) or not at:
        return [at] if at else []
    reach = np.abs(effect.design(table.x, _any(effect))).max(axis=0)[:, at]
    own = [tuple(np.array(at)[reach[c] > 0].tolist()) for c in range(6)]
    own = [o for o in own if o and o != at]
    two = [tuple(sorted(set(o + p))) for o, p in combinations(own, 2)]
    more = [*own, *([] if effect.shapes else two)]
    return [at, *(o for o in dict.fromkeys(more) if o != at)]


def units_of(table: ColumnTable, effect: Effect) -> Array:
    """Outputs per SI unit for each parameter, (k,), of what adds to outputs."""
    if isinstance(effect, Motion):
        return np.ones(len(effect.params))
    gyro = [p.unit.startswith(("rad", "(rad")) for p in effect.params]
    out: Array = np.abs(np.where(gyro, table.unit[3], table.unit[0]))
    return out


def points(table: ColumnTable, effect: Effect) -> Iterator[Point]:
    """Values of the shape parameters to try, with the origin of times."""
    if not effect.shapes:
        yield {}, 0
    for shape in effect.shapes:
        for value, origin in shape.grid(table.x, table.since):
            yield {shape.name: value}, origin


def _any(effect: Effect) -> dict[str, float]:
    """Some shape, where only which output has a column is asked."""
    return {
        s.name: max(s.low, 1.0) if np.isfinite(s.low) else 0.0 for s in effect.shapes
    }
