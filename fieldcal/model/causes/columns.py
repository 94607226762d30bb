"""Columns of the calibration, the site and the orientations: derivatives of the rows.

Each is by parameters that every session has: biases, scale factors, gravity, speeds,
the Earth's rate, attitudes and small rotations of positions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

import numpy as np

from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import GYR, Array
from fieldcal.model import tolerances
from fieldcal.model.causes.basis import (
    CentralDifference,
    RowView,
    central_differences,
)
from fieldcal.model.state import State, perpendicular_vectors
from fieldcal.physics.experience import Experience


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


def clock(view: RowView) -> Array:
    """Derivative of the outputs by a relative error of the times, (n, 6, 1).

    A turn between known angles that a clock counts too many seconds for is taken for
    slower than it was, so that the outputs are larger than for such a turn. Rates of a
    device at rest are the Earth's, whatever its clock.
    """
    out = np.zeros((len(view.x), 6, 1))
    if np.all(view.x.position < 0):
        out[:, GYR, 0] = view.state.scale[GYR] * view.x.w
    return out


def speed(known: Array) -> Callable[[RowView], Array]:
    """Derivatives by relative changes of the speeds (k,) of a rate table, (n, 6, k)."""

    def of(view: RowView) -> Array:
        table = view.state.scale * np.hstack([np.zeros_like(view.x.f), view.x.w])
        here = view.x.speed[:, None] == known
        out: Array = table[:, :, None] * here[:, None, :]
        return out

    return of


def state_sides(
    plain: Experience, state: State, name: str, steps: Iterable[Array]
) -> Iterator[CentralDifference]:
    """Inputs for each of some steps of an array of the state, up and down.

    `name` is that of the array; a step has the same value where it is not zero.
    """
    for step in steps:
        ends = ({name: getattr(state, name) + s * step} for s in (1.0, -1.0))
        up, down = (replace(state, **end).experienced(plain) for end in ends)
        yield up, down, float(step.max())


def earth_sides(view: RowView) -> Iterator[CentralDifference]:
    """Inputs for a change of the base's rate about each of its axes, rad/s."""
    for step in EARTH_RATE * np.eye(3):
        rates = (view.state.earth + s * step for s in (1.0, -1.0))
        ends = (replace(view.state, earth=rate) for rate in rates)
        up, down = (state.moved(state.with_earth(view.rotated)) for state in ends)
        yield up, down, float(step.max())


earth = central_differences(earth_sides)


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
    axes = np.swapaxes(view.x.to_device_in(held), 1, 2)  # of the base, in device axes
    at = 3 * view.nominal.position[held]
    for i in range(3):
        change = [np.cross(v[held], axes[:, i]) for v in (view.x.f, view.x.w)]
        out[held, :, at + i] = view.state.scale * np.nan_to_num(np.hstack(change))
    return out


def attitude_sides(view: RowView) -> Iterator[CentralDifference]:
    """Inputs for a change of the measured attitudes about each base axis, rad."""
    state = view.state
    if not state.attitude.any():
        state = replace(state, attitude=np.zeros((len(state.small_rotation), 3)))
    return state_sides(
        view.nominal, state, "attitude", tolerances.ROTATION_STEP_RAD * np.eye(3)
    )


def small_rotation_sides(view: RowView) -> Iterator[CentralDifference]:
    """Inputs for two small rotations of every position, rad."""
    steps = tolerances.ROTATION_STEP_RAD * np.eye(2)
    return state_sides(view.nominal, view.state, "small_rotation", steps)


def small_rotation(view: RowView) -> Array:
    """Columns of two small rotations of every position, (n, 6, 2 p)."""
    places = len(view.state.small_rotation)
    out = np.zeros((len(view.x), 6, 2 * places))
    at = view.nominal.position
    held = np.flatnonzero(at >= 0)
    change = all_rotated(view)[held]
    for joint in range(2):
        out[held, :, 2 * at[held] + joint] = change[:, :, joint]
    return out


all_rotated = central_differences(small_rotation_sides)
"""Columns of two small rotations that all positions have in common, (n, 6, 2)."""
