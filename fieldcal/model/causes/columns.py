"""Columns: the derivative of the rows by what a group can change.

A `Course` is one function of the row on every channel, one column for each channel; all
other columns are general. Windows and turns use the same object, with what the device
experiences there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby
from operator import itemgetter

import numpy as np

from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import Array
from fieldcal.model.state import State, Term, across
from fieldcal.physics.effect import (
    NO_SHAPE,
    BiasChange,
    Effect,
    Motion,
    Sensor,
    Separable,
)
from fieldcal.physics.experience import Experience

STEP = 1e-3
"""Of numerical derivatives, in typical sizes."""

SMALL = 1e-5
"""Of turns, rad."""

CentralDifference = tuple[Experience, Experience, float]
Sides = Callable[[Experience, State], Iterator[CentralDifference]]


@dataclass(frozen=True, slots=True)
class RowView:
    """Rows as columns see them.

    Attributes
    ----------
    plain : before the state changes what is experienced
    x : as the state has it
    since : (o, n) s since the turn, by origin
    state : the base state
    rotations : what `small_rotation` found, if it was asked for

    """

    plain: Experience
    x: Experience
    since: Array
    state: State
    _by_origin: dict[int, Experience] = field(default_factory=dict, repr=False)
    rotations: list[Array] = field(default_factory=list, repr=False)

    @classmethod
    def of(cls, plain: Experience, since: Array, state: State) -> RowView:
        """Rows at a base state."""
        return cls(plain, state.experienced(plain), since, state)

    def counting_from(self, origin: int) -> Experience:
        """Rows as the state has them, since the turn by one origin."""
        if origin not in self._by_origin:
            seen = replace(self.x, since_turn=self.since[origin])
            self._by_origin[origin] = seen
        return self._by_origin[origin]


@dataclass(frozen=True, slots=True)
class Course:
    """A function of the row alone, (n, m), on every channel: 6 m columns.

    `timed` says that it is known on the way between windows as well, `standing` that it
    is there while an output of the gyroscopes stands on its value of the windows.
    """

    name: str
    of: Callable[[RowView], Array]
    width: int
    timed: bool = False
    standing: bool = False


@dataclass(frozen=True, slots=True)
class General:
    """Columns (n, 6, k) of any form.

    Attributes
    ----------
    name : what it is called
    of : the columns of rows
    sides : where it changes what is experienced in positions, rows with each column a
        step up and down, and the step
    each : whether every position has columns of its own, which follow each other; in
        `sides` all positions are then changed at once
    along : whether rows of a turn have it by those beside them

    """

    name: str
    of: Callable[[RowView], Array]
    sides: Sides | None = None
    each: bool = False
    along: bool = False


def of_effect(effect: Effect, shape: Mapping[str, float], origin: int) -> General:
    """Columns of an effect of the catalogue."""

    def sensor(view: RowView) -> Array:
        seen = view.counting_from(origin)
        design: Array = effect.design(seen, shape or NO_SHAPE)  # type: ignore[attr-defined]
        return design

    def sides(plain: Experience, state: State) -> Iterator[CentralDifference]:
        for j, param in enumerate(effect.params):
            step = np.zeros(len(effect.params))
            step[j] = STEP * param.typical
            up, down = (_with(plain, state, effect, s) for s in (step, -step))
            yield up, down, float(step[j])

    def on_the_way(view: RowView) -> Array:
        columns = []
        for j, param in enumerate(effect.params):
            step = np.zeros(len(effect.params))
            step[j] = STEP * param.typical
            ends = [effect.change(view.x, s) for s in (step, -step)]  # type: ignore[attr-defined]
            columns.append(_difference(ends[0], ends[1], float(step[j]), view.state))
        return np.stack(columns, axis=2)

    if isinstance(effect, Motion):
        if effect.on_the_way:
            return General(effect.id, on_the_way)
        return General(effect.id, _of_sides(sides), sides=sides)
    return General(effect.id, sensor)


def of_channels(
    effect: BiasChange, grid: Sequence[tuple[Mapping[str, float], int]]
) -> Course:
    """Courses of an effect that does the same to every output, by shape and origin."""

    def of(view: RowView) -> Array:
        courses = []
        for shape, origin in grid:
            seen = view.counting_from(origin)
            courses.append(effect.course(seen, shape or NO_SHAPE))
        return np.stack(courses, axis=1)

    return Course(effect.id, of, len(grid), True)


def of_courses(
    effect: Separable, grid: Sequence[tuple[Mapping[str, float], int]]
) -> General:
    """Columns of a pattern times each of several courses, point by point."""

    def of(view: RowView) -> Array:
        parts = []
        for origin, some in groupby(grid, key=itemgetter(1)):
            seen = view.counting_from(origin)
            pattern = effect.pattern(seen)
            courses = [effect.course(seen, shape or NO_SHAPE) for shape, _ in some]
            each = pattern[:, :, None] * np.stack(courses, axis=1)[:, None, :, None]
            parts.append(each.reshape(len(view.x), 6, -1))
        return np.concatenate(parts, axis=2)

    return General(effect.id, of)


def _of_sides(sides: Sides) -> Callable[[RowView], Array]:
    """Columns as central differences of what is experienced."""

    def of(view: RowView) -> Array:
        columns = [
            _difference(up, down, step, view.state)
            for up, down, step in sides(view.plain, view.state)
        ]
        return np.stack(columns, axis=2)

    return of


def _difference(up: Experience, down: Experience, step: float, state: State) -> Array:
    """Difference of the outputs of two states of what is experienced, per step."""
    change: Array = np.hstack([up.f - down.f, up.w - down.w]) * state.scale
    for term in state.terms:
        if isinstance(term.effect, Sensor):
            shape = term.shape or NO_SHAPE
            ends = (term.effect.design(x, shape) for x in (up, down))
            one, other = (design @ term.values for design in ends)
            change = change + one - other
    return change / (2 * step)


def _with(plain: Experience, state: State, effect: Effect, more: Array) -> Experience:
    """What is experienced with an effect's parameters changed."""
    there = [t.values for t in state.terms if t.effect is effect]
    rest = tuple(t for t in state.terms if t.effect is not effect)
    term = Term(effect, sum(there, np.zeros(len(more))) + more)
    return replace(state, terms=(*rest, term)).experienced(plain)


def bias(view: RowView) -> Array:
    """One on each output's own bias."""
    return np.broadcast_to(np.eye(6), (len(view.x), 6, 6))


def scale(view: RowView) -> Array:
    """Force and rate along each output's own axis."""
    return np.eye(6) * np.hstack([view.x.f, view.x.w])[:, :, None]


def gravity(view: RowView) -> Array:
    """What more of all gravity brings about, of its relative size, (n, 6, 1)."""
    out: Array = view.state.scale * np.hstack([view.x.f, np.zeros_like(view.x.w)])
    return out[:, :, None]


def speed(known: Array) -> Callable[[RowView], Array]:
    """What more of each speed (k,) of a table brings about, of its size, (n, 6, k)."""

    def of(view: RowView) -> Array:
        table = view.state.scale * np.hstack([np.zeros_like(view.x.f), view.x.w])
        here = view.x.speed[:, None] == known
        out: Array = table[:, :, None] * here[:, None, :]
        return out

    return of


def earth_sides(plain: Experience, state: State) -> Iterator[CentralDifference]:
    """The rate of the base about each of its axes, rad/s."""
    for axis in np.eye(3):
        up, down = (
            replace(state, earth=state.earth + sign * EARTH_RATE * axis).experienced(
                plain
            )
            for sign in (1.0, -1.0)
        )
        yield up, down, EARTH_RATE


earth = _of_sides(earth_sides)


def earth_anyhow(view: RowView) -> Array:
    """Rates in device axes and along the force, where nobody knows the orientation.

    Turned about one level axis by hand, a device has the Earth's rate along it in every
    position and on the way; and however it lies, its upright part along the force. Not
    where gyroscopes show which way it points. (n, 6, 4), rad/s.
    """
    free = view.plain.earth_unseen
    f = view.x.f
    up = f / np.maximum(np.linalg.norm(f, axis=1), 1e-12)[:, None]
    along = np.hstack([np.zeros_like(up), up])[:, :, None]
    every = np.tile(np.eye(6)[:, 3:], (len(f), 1, 1))
    out: Array = np.concatenate([every, along], axis=2) * view.state.scale[:, None]
    return out * free[:, None, None]


def earth_aside(view: RowView) -> Array:
    """Two small turns of the Earth's rate that is shown, position by position, rad.

    About axes across it, (n, 6, 2 p): its length is all that is known.
    """
    places = len(view.state.small_rotation)
    out = np.zeros((len(view.x), 6, 2 * places))
    seen = np.flatnonzero(view.plain.earth_seen)
    for k, side in enumerate(across(view.x.w[seen])):
        at = 2 * view.plain.position[seen] + k
        out[seen[:, None], [3, 4, 5], at[:, None]] = view.state.scale[3:] * side
    return out


def attitude(view: RowView) -> Array:
    """Small turns of each position about x, y and z of the base, rad, (n, 6, 3 p).

    What a measured attitude is off by: beside it the force and the Earth's rate lie
    elsewhere. Turns between two positions are off by both.
    """
    places = len(view.state.small_rotation)
    out = np.zeros((len(view.x), 6, 3 * places))
    held = np.flatnonzero(view.plain.position >= 0)
    axes = np.swapaxes(view.x.to_device[held], 1, 2)  # of the base, in device axes
    at = 3 * view.plain.position[held]
    for i in range(3):
        off = [np.cross(v[held], axes[:, i]) for v in (view.x.f, view.x.w)]
        out[held, :, at + i] = view.state.scale * np.nan_to_num(np.hstack(off))
    return out


def attitude_sides(plain: Experience, state: State) -> Iterator[CentralDifference]:
    """The same, where turns meet the positions."""
    known = state.attitude
    if not known.any():
        known = np.zeros((len(state.small_rotation), 3))
    for off in SMALL * np.eye(3):
        ends = (replace(state, attitude=known + s * off) for s in (1.0, -1.0))
        up, down = (one.experienced(plain) for one in ends)
        yield up, down, SMALL


def small_rotation_sides(
    plain: Experience, state: State
) -> Iterator[CentralDifference]:
    """Two small turns of every position, rad."""
    small = state.small_rotation
    for off in SMALL * np.eye(2):
        ends = (replace(state, small_rotation=small + s * off) for s in (1.0, -1.0))
        up, down = (one.experienced(plain) for one in ends)
        yield up, down, SMALL


def small_rotation(view: RowView) -> Array:
    """The same as columns (n, 6, 2 p), those of a position together."""
    if not view.rotations:
        view.rotations.append(_small_rotation(view))
    return view.rotations[0]


def _small_rotation(view: RowView) -> Array:
    """The same, not asked for yet."""
    places = len(view.state.small_rotation)
    out = np.zeros((len(view.x), 6, 2 * places))
    at = view.plain.position
    held = np.flatnonzero(at >= 0)
    sides = small_rotation_sides(view.plain, view.state)
    for joint, (up, down, step) in enumerate(sides):
        change = _difference(up, down, step, view.state)
        out[held, :, 2 * at[held] + joint] = change[held]
    return out
