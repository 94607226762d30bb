"""Columns: the derivatives of the rows by the parameters of a group.

A `Course` is a function of the row, with one column for each channel. All other columns
are `General`. Windows and turns use the same objects, with the inputs of the device in
each.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby
from operator import itemgetter

import numpy as np

from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import Array
from fieldcal.model.state import State, Term, perpendicular_vectors
from fieldcal.physics.effect import (
    NO_SHAPE,
    BiasChange,
    Effect,
    Motion,
    Sensor,
    Separable,
)
from fieldcal.physics.experience import Experience

DERIVATIVE_STEP = 1e-3
"""Step of numerical derivatives, in typical sizes."""

ROTATION_STEP_RAD = 1e-5
"""Step of numerical derivatives by rotations, rad."""

CentralDifference = tuple[Experience, Experience, float]
Sides = Callable[[Experience, State], Iterator[CentralDifference]]


@dataclass(frozen=True, slots=True)
class RowView:
    """Rows at which columns are evaluated.

    Attributes
    ----------
    nominal : inputs of the device without the state's rotations and motion effects
    x : inputs of the device with them
    since : (o, n) s since the turn, by origin of the time
    state : the base state
    rotations : cached result of `small_rotation`

    """

    nominal: Experience
    x: Experience
    since: Array
    state: State
    # caches; not passed on to copies, which may have other inputs
    _by_origin: dict[int, Experience] = field(
        default_factory=dict, init=False, repr=False
    )
    rotations: list[Array] = field(default_factory=list, init=False, repr=False)

    @classmethod
    def of(cls, plain: Experience, since: Array, state: State) -> RowView:
        """Rows at a base state."""
        return cls(plain, state.experienced(plain), since, state)

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


def effect_basis(effect: Effect, shape: Mapping[str, float], origin: int) -> General:
    """Columns of an effect of the catalogue."""

    def sensor(view: RowView) -> Array:
        inputs = view.with_origin(origin)
        design: Array = effect.design(inputs, shape or NO_SHAPE)  # type: ignore[attr-defined]
        return design

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
            columns.append(_difference(ends[0], ends[1], float(step[j]), view.state))
        return np.stack(columns, axis=2)

    if isinstance(effect, Motion):
        if effect.on_the_way:
            return General(effect.id, on_the_way)
        return General(effect.id, _central_differences(sides), sides=sides)
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
        return np.concatenate(parts, axis=2)

    return General(effect.id, of)


def _central_differences(sides: Sides) -> Callable[[RowView], Array]:
    """Columns as central differences over the inputs."""

    def of(view: RowView) -> Array:
        columns = [
            _difference(up, down, step, view.state)
            for up, down, step in sides(view.nominal, view.state)
        ]
        return np.stack(columns, axis=2)

    return of


def _difference(up: Experience, down: Experience, step: float, state: State) -> Array:
    """Derivative of the outputs (n, 6) as a central difference.

    `up` and `down` are the inputs for a parameter one `step` higher and lower.
    """
    change: Array = np.hstack([up.f - down.f, up.w - down.w]) * state.scale
    for term in state.terms:
        if isinstance(term.effect, Sensor):
            shape = term.shape or NO_SHAPE
            ends = (term.effect.design(x, shape) for x in (up, down))
            at_up, at_down = (design @ term.values for design in ends)
            change = change + at_up - at_down
    return change / (2 * step)


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


def bias(view: RowView) -> Array:
    """Derivative of the outputs by the six biases, (n, 6, 6)."""
    return np.broadcast_to(np.eye(6), (len(view.x), 6, 6))


def scale(view: RowView) -> Array:
    """Derivative of the outputs by the six scale factors, (n, 6, 6)."""
    return np.eye(6) * np.hstack([view.x.f, view.x.w])[:, :, None]


def gravity(view: RowView) -> Array:
    """Derivative of the outputs by a relative change of gravity, (n, 6, 1)."""
    out: Array = view.state.scale * np.hstack([view.x.f, np.zeros_like(view.x.w)])
    return out[:, :, None]


def speed(known: Array) -> Callable[[RowView], Array]:
    """Derivatives by relative changes of the speeds (k,) of a rate table, (n, 6, k)."""

    def of(view: RowView) -> Array:
        table = view.state.scale * np.hstack([np.zeros_like(view.x.f), view.x.w])
        here = view.x.speed[:, None] == known
        out: Array = table[:, :, None] * here[:, None, :]
        return out

    return of


def earth_sides(plain: Experience, state: State) -> Iterator[CentralDifference]:
    """Inputs for a change of the base's rate about each of its axes, rad/s."""
    for axis in np.eye(3):
        up, down = (
            replace(state, earth=state.earth + sign * EARTH_RATE * axis).experienced(
                plain
            )
            for sign in (1.0, -1.0)
        )
        yield up, down, EARTH_RATE


earth = _central_differences(earth_sides)


def earth_rate_unoriented(view: RowView) -> Array:
    """Columns of the Earth's rate in unknown orientations, (n, 6, 4), rad/s.

    The first three are constant rates in device axes: if a device is turned by hand
    about one level axis, the Earth's rate along that axis is the same in every position
    and during turns. The fourth is a rate along the force, the vertical part of the
    Earth's rate. All are zero in rows whose gyroscopes show the direction of the
    Earth's rate.
    """
    free = view.nominal.earth_unseen
    f = view.x.f
    up = f / np.maximum(np.linalg.norm(f, axis=1), 1e-12)[:, None]
    along = np.hstack([np.zeros_like(up), up])[:, :, None]
    constant = np.tile(np.eye(6)[:, 3:], (len(f), 1, 1))
    out: Array = np.concatenate([constant, along], axis=2) * view.state.scale[:, None]
    return out * free[:, None, None]


def earth_rate_direction(view: RowView) -> Array:
    """Columns of small rotations of a measured Earth's rate, (n, 6, 2 p), rad.

    Two for each position, about axes perpendicular to the rate: only its length is
    known.
    """
    places = len(view.state.small_rotation)
    out = np.zeros((len(view.x), 6, 2 * places))
    determined = np.flatnonzero(view.nominal.earth_seen)
    for k, side in enumerate(perpendicular_vectors(view.x.w[determined])):
        at = 2 * view.nominal.position[determined] + k
        out[determined[:, None], [3, 4, 5], at[:, None]] = view.state.scale[3:] * side
    return out


def attitude(view: RowView) -> Array:
    """Columns of errors of measured attitudes, (n, 6, 3 p), rad.

    They are small rotations of each of p positions about x, y and z of the base, which
    rotate the force and the Earth's rate in device axes. A turn depends on the errors
    at both ends.
    """
    places = len(view.state.small_rotation)
    out = np.zeros((len(view.x), 6, 3 * places))
    held = np.flatnonzero(view.nominal.position >= 0)
    axes = np.swapaxes(view.x.to_device[held], 1, 2)  # of the base, in device axes
    at = 3 * view.nominal.position[held]
    for i in range(3):
        change = [np.cross(v[held], axes[:, i]) for v in (view.x.f, view.x.w)]
        out[held, :, at + i] = view.state.scale * np.nan_to_num(np.hstack(change))
    return out


def attitude_sides(plain: Experience, state: State) -> Iterator[CentralDifference]:
    """Inputs for a change of the measured attitudes about each base axis, rad."""
    known = state.attitude
    if not known.any():
        known = np.zeros((len(state.small_rotation), 3))
    for step in ROTATION_STEP_RAD * np.eye(3):
        ends = (replace(state, attitude=known + s * step) for s in (1.0, -1.0))
        up, down = (shifted.experienced(plain) for shifted in ends)
        yield up, down, ROTATION_STEP_RAD


def small_rotation_sides(
    plain: Experience, state: State
) -> Iterator[CentralDifference]:
    """Inputs for two small rotations of every position, rad."""
    small = state.small_rotation
    for step in ROTATION_STEP_RAD * np.eye(2):
        ends = (replace(state, small_rotation=small + s * step) for s in (1.0, -1.0))
        up, down = (shifted.experienced(plain) for shifted in ends)
        yield up, down, ROTATION_STEP_RAD


def small_rotation(view: RowView) -> Array:
    """Columns of two small rotations of every position, (n, 6, 2 p); cached."""
    if not view.rotations:
        view.rotations.append(_small_rotation(view))
    return view.rotations[0]


def _small_rotation(view: RowView) -> Array:
    """Calculate the columns of `small_rotation`."""
    places = len(view.state.small_rotation)
    out = np.zeros((len(view.x), 6, 2 * places))
    at = view.nominal.position
    held = np.flatnonzero(at >= 0)
    sides = small_rotation_sides(view.nominal, view.state)
    for joint, (up, down, step) in enumerate(sides):
        change = _difference(up, down, step, view.state)
        out[held, :, 2 * at[held] + joint] = change[held]
    return out
