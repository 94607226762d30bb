"""Specific force and angular rate of the device on a moving base with turning joints.

The frames follow each other from the local level to the device, each turned about an
axis of the one before by an angle x(t) about the unit axis u:

    navigation (East, down, north) -> heading -> tilt of the base -> rocking
    -> alpha about z -> beta about x -> gamma about y -> spin of a rate table, or a way
    that is given -> signed device axes

Attitude q, rate w and its derivative dw are handed down from frame to frame:

    q  <- q (x) (cos x/2, u sin x/2)                                (m1)
    w  <- T w + u x'                                                (m2)
    dw <- T dw - u x' cross T w + u x''                             (m3)

with T the transformation into the next frame. In the last frame, specific force and
angular rate at the sensors are

    f = T_q (a - g) + dw cross r + w cross (w cross r)              (m4)
    rate = w + T_q W (0, -sin phi, cos phi)                         (m5)

with T_q the transformation by the attitude q from the local level, g = (0, g, 0)
pointing down, a the acceleration of the base, r the lever arm from
the turning centre to the sensors, W the Earth's rate and phi the latitude. Coriolis
terms of the Earth's rate (1e-5 m/s^2 in a turn) are left out. Source: rigid-body
kinematics in turning frames, e.g. Goldstein, Classical Mechanics, chapter 4.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.sim_device.joints import ALPHA, BETA, GAMMA, SPIN, JointStates
from fieldcal.sim_device.quaternion import STILL, cross, multiply, to_frame, turn

X: Array = np.array([[1.0], [0.0], [0.0]])
Y: Array = np.array([[0.0], [1.0], [0.0]])
Z: Array = np.array([[0.0], [0.0], [1.0]])


@dataclass(frozen=True, slots=True)
class Angle:
    """An angle with its first two derivatives at n instants; rad, rad/s, rad/s^2."""

    x: Array
    rate: Array
    acceleration: Array


@dataclass(frozen=True, slots=True)
class BaseMotion:
    """Temporary motion of the base: oscillation about a level axis, and a push.

    Attributes
    ----------
    axis : unit vector (3, 1), level axes
    angle : of the rocking, at instants (n,) s
    push : acceleration (3, n) m/s^2, level axes, at instants (n,) s; None: none
    start, end : s, between which it moves

    """

    axis: Array
    angle: Callable[[Array], Angle]
    push: Callable[[Array], Array] | None = None
    start: float = -np.inf
    end: float = np.inf

    def lasts(self, first: float, last: float) -> bool:
        """Whether it moves between two instants, s."""
        return self.start <= last and first <= self.end


@dataclass(frozen=True, slots=True)
class MovingFrame:
    """Attitude q (4, n), rate w (3, n) and its derivative, in the frame's own axes."""

    q: Array
    w: Array
    dw: Array

    @classmethod
    def level(cls, n: int) -> MovingFrame:
        """Frame of the local level: East, down, north."""
        zero = np.zeros((3, n))
        return cls(STILL + np.zeros((4, n)), zero, zero)

    def turned(self, axis: Array, angle: Angle) -> MovingFrame:
        """Next frame, turned by `angle` about `axis` of this one."""
        about, speeding = axis * angle.rate, axis * angle.acceleration
        return self.then(turn(axis, angle.x), about, speeding)

    def then(self, step: Array, about: Array, speeding: Array) -> MovingFrame:
        """Next frame, in any motion against this one.

        Parameters
        ----------
        step : (4, n) its attitude in this one
        about, speeding : (3, n) its rate against this one and the derivative, rad/s and
            rad/s^2, in its own axes

        """
        w = to_frame(step, self.w)
        dw = to_frame(step, self.dw) - cross(about, w) + speeding
        return MovingFrame(multiply(self.q, step), w + about, dw)  # (m1) (m2) (m3)


@dataclass(frozen=True, slots=True)
class Installation:
    """Site and mounting of the device, without the joints.

    Attributes
    ----------
    gravity : m/s^2
    earth : rate of (East, down, north) by the Earth, zero if not felt, and by a motion
        over it, (3, 1) rad/s
    pull : acceleration by that motion, (3, 1) m/s^2
    base : attitude of the base against the local level, (4, 1)
    axes : (3,) index and (3, 1) sign: procedure axis i is device axis index[i]
    signs : see `axes`
    lever : from the turning centre to the sensors, device axes, (3, 1) m

    """

    gravity: float
    earth: Array
    pull: Array
    base: Array
    axes: tuple[int, int, int]
    signs: Array
    lever: Array

    def to_device(self, v: Array) -> Array:
        """Components along the device's axes of a vector (3, n) in procedure axes."""
        out = np.empty_like(v)
        out[list(self.axes)] = self.signs * v
        return out

    def from_device(self, v: Array) -> Array:
        """Components along procedure axes of a vector (3, n) in device axes."""
        return self.signs * v[list(self.axes)]


@dataclass(frozen=True, slots=True)
class SensorMotion:
    """True specific force and angular rate at n instants, device axes.

    Attributes
    ----------
    f : (3, n) m/s^2
    w : (3, n) rad/s

    """

    f: Array
    w: Array


def base_frame(
    stand: Installation, moves: Sequence[BaseMotion], t: Array, swing: JointStates
) -> MovingFrame:
    """Frame of the procedure axes at instants `t`, (n,) s."""
    frame = MovingFrame.level(len(t))
    frame = MovingFrame(stand.base + np.zeros_like(frame.q), frame.w, frame.dw)
    for move in moves:
        frame = frame.turned(move.axis, move.angle(t))
    for axis, joint in ((Z, ALPHA), (X, BETA)):
        frame = frame.turned(axis, _joint(swing, joint))
    for axis, joint in ((Y, GAMMA), (swing.axis, SPIN)):
        if np.any(swing.angle[joint]):
            frame = frame.turned(axis, _joint(swing, joint))
    return frame


def sensor_motion(
    stand: Installation, frame: MovingFrame, acceleration: Array
) -> SensorMotion:
    """What the sensors feel, with the base accelerated by (3, n) m/s^2, level axes."""
    f = to_frame(frame.q, acceleration + stand.pull - stand.gravity * Y)
    if np.any(stand.lever):
        arm = stand.from_device(stand.lever)
        arm = arm + np.zeros_like(f)
        f = f + cross(frame.dw, arm) + cross(frame.w, cross(frame.w, arm))  # (m4)
    w = frame.w + to_frame(frame.q, stand.earth + np.zeros_like(f))  # (m5)
    return SensorMotion(stand.to_device(f), stand.to_device(w))


def level_axis(azimuth: float) -> Array:
    """Unit vector (3, 1) in the level, `azimuth` rad from East towards north."""
    return np.array([[np.cos(azimuth)], [0.0], [np.sin(azimuth)]])


def mounting_axes(
    names: Iterable[str], right_handed: bool
) -> tuple[tuple[int, int, int], tuple[float, float, float]]:
    """Index and sign of the device axis along each procedure axis.

    Raises
    ------
    InputError
        If they are not three different signed axes, or not right-handed.

    """
    axes = tuple(names)
    index = [("xyz" + "?").find(name[-1:] or "?") for name in axes]
    signs = [-1.0 if name.startswith("-") else 1.0 for name in axes]
    if sorted(index) != [0, 1, 2] or any(len(name) > 2 for name in axes):
        raise InputError(
            f'mounting {list(axes)} is not three signed axes such as ["+x", "-z", "+y"]'
        )
    cyclic = (index[1] - index[0]) % 3 == 1
    if right_handed and math.prod(signs) * (1 if cyclic else -1) < 0:
        raise InputError(
            f"mounting {list(axes)} is left-handed, and no device is: check the signs"
        )
    return (index[0], index[1], index[2]), (signs[0], signs[1], signs[2])


def _joint(swing: JointStates, i: int) -> Angle:
    return Angle(swing.angle[i], swing.rate[i], swing.acceleration[i])
