"""Motion of the joints that carry the device: angles as smooth functions of time.

Four joints in a row: alpha about z, beta about the turned x, gamma about the twice
turned y, and the spin of a rate table about an axis fixed in the device. Each moves
along a polynomial of fifth degree that meets angle, rate and rest of acceleration at
both ends:

    x(s) = sum c_k s^k,  s = t - start                              (j1)
    d = x1 - x0 - v0 T
    c3 = (10 d - 4 (v1 - v0) T) / T^3                               (j2)
    c4 = (-15 d + 7 (v1 - v0) T) / T^4                              (j3)
    c5 = (6 d - 3 (v1 - v0) T) / T^5                                (j4)

(j2) to (j4) follow from x(T) = x1, x'(T) = v1, x''(0) = x''(T) = 0. From rest to rest
the rate peaks at 15/8 of the mean rate. Angles in rad, times in s.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from fieldcal.core.samples import Array

JOINTS = 4
ALPHA, BETA, GAMMA, SPIN = range(JOINTS)

NOTHING = 1e-12
"""Share of a creep from which on the joint rests."""

Angles = tuple[float, float, float]
"""Alpha, beta and gamma, rad."""


@dataclass(frozen=True, slots=True)
class JointStates:
    """States of the joints at n instants.

    Attributes
    ----------
    angle, rate, acceleration : (4, n) of the joints; rad, rad/s, rad/s^2
    axis : (3, n) unit axis of the spin, procedure axes
    since_turn : (n,) s since the last turn ended, negative in a turn, inf before any
    turn_progress : (n,) share of the last turn's duration that has passed, 0 before any
    position : (n,) how many turns have begun

    """

    angle: Array
    rate: Array
    acceleration: Array
    axis: Array
    since_turn: Array
    turn_progress: Array
    position: Array


@dataclass(frozen=True, slots=True)
class Creep:
    """Overshoot of joints in a turn, and their relaxation afterwards.

    Attributes
    ----------
    by : (joints,) overshoot of a turn in which the angle rises, rad
    tau : time constant of the relaxation, s

    """

    by: Array
    tau: float

    def at(self, t: Array, turn: tuple[float, float], side: Array) -> Array:
        """What a turn from one instant to another adds, with its two derivatives.

        Parameters
        ----------
        t : (n,) s
        turn : start and end, s
        side : (joints,) 1 if the angle rises, -1 if it falls, 0 if it stays

        Returns
        -------
        array, (3, joints, n), rad, rad/s and rad/s^2

        """
        (start, end), length = turn, turn[1] - turn[0]
        u = np.clip((t - start) / length, 0.0, 1.0)
        going = (
            u**3 * (10 - 15 * u + 6 * u**2),
            30 * u**2 * (1 - u) ** 2 / length,
            60 * u * (1 - u) * (1 - 2 * u) / length**2,
        )
        left = np.exp(-np.maximum(t - end, 0.0) / self.tau)
        left[left < NOTHING] = 0.0
        back = (left, -left / self.tau, left / self.tau**2)
        course = [np.where(t < end, g, b) for g, b in zip(going, back, strict=True)]
        out: Array = np.array(course)[:, None] * (self.by * side)[:, None]
        return out


@dataclass(slots=True)
class _Segment:
    start: float
    axis: Array
    coefficients: Array  # (6, joints), of ascending powers


@dataclass(slots=True)
class Joints:
    """Segments of motion, appended as the device is told to move."""

    angles: Angles
    creeps: tuple[Creep, ...] = ()
    turns: list[tuple[float, float]] = field(default_factory=list)
    spins: bool = False
    _segments: list[_Segment] = field(default_factory=list)
    _sides: list[Array] = field(default_factory=list)

    def __post_init__(self) -> None:
        rest = _polynomial(np.array([*self.angles, 0.0]), np.zeros(JOINTS))
        self._segments.append(_Segment(-np.inf, np.array([0.0, 1.0, 0.0]), rest))

    @property
    def busy_until(self) -> float:
        """When the last turn ends, s; -inf before any."""
        return self.turns[-1][1] if self.turns else -np.inf

    def turn(self, start: float, seconds: float, angles: Angles) -> tuple[float, float]:
        """Turn to `angles` and stop any spin; returns when it starts and ends, s.

        A turn that is told while another is under way follows it.
        """
        return self._move(start, seconds, angles, np.zeros(3))

    def spin(
        self,
        start: float,
        seconds: float,
        angles: Angles,
        rate: tuple[float, float, float],
    ) -> tuple[float, float]:
        """Turn to `angles` and run up to a constant `rate`, rad/s about device axes.

        A spin about another axis is first brought to rest at a whole revolution, in
        the first half of the time.
        """
        wanted = np.asarray(rate, float)
        old = self._segments[-1]
        along = float(np.dot(old.axis, wanted))
        same = along >= 0 and np.allclose(wanted, along * old.axis)
        if old.coefficients[1, SPIN] and not same:
            half, before = seconds / 2, old.coefficients[0]
            _, rested = self._move(start, half, angles, np.zeros(3), counts=False)
            began = max(start, self.busy_until)
            _, end = self._move(rested, half, angles, wanted, counts=False)
            self._turned(began, end, before)
            return began, end
        return self._move(start, seconds, angles, wanted)

    def _move(
        self,
        start: float,
        seconds: float,
        angles: Angles,
        rate: Array,
        counts: bool = True,
    ) -> tuple[float, float]:
        start = max(start, self.busy_until)
        place, speed = self._state(start)
        magnitude = float(np.sqrt(np.sum(rate**2)))
        axis = rate / magnitude if magnitude else self._segments[-1].axis
        coast = place[SPIN] + (speed[SPIN] + magnitude) * seconds / 2
        whole = 2 * np.pi * np.round(coast / (2 * np.pi))
        target = np.array([*angles, coast if magnitude else whole])
        final = np.array([0.0, 0.0, 0.0, magnitude])
        path = _hermite(place, speed, target, final, seconds)
        end = start + seconds
        self._segments.append(_Segment(start, axis, path))
        self._segments.append(_Segment(end, axis, _polynomial(target, final)))
        self.spins = self.spins or bool(magnitude)
        if counts:
            self._turned(start, end, place)
        return start, end

    def _turned(self, start: float, end: float, before: Array) -> None:
        """Keep a turn from where the joints were, and from which side it came."""
        self.turns.append((start, end))
        side = np.sign(self._segments[-1].coefficients[0] - before)
        self._sides.append(np.where(np.arange(JOINTS) == SPIN, 0.0, side))

    def _state(self, t: float) -> tuple[Array, Array]:
        """Angles and rates of the joints at rest or in steady spin at `t`, (4,)."""
        last = self._segments[-1]
        s = t - last.start if np.isfinite(last.start) else 0.0
        return last.coefficients[0] + last.coefficients[1] * s, last.coefficients[1]

    def at(self, t: Array) -> JointStates:
        """Where the joints are at ascending instants `t`, (n,) s."""
        n = len(t)
        angle, rate, acceleration = (np.empty((JOINTS, n)) for _ in range(3))
        axis = np.empty((3, n))
        for rows, segment in self._pieces(t):
            s = t[rows] - (segment.start if np.isfinite(segment.start) else 0.0)
            x, v, a = _evaluate(segment.coefficients, s)
            angle[:, rows], rate[:, rows], acceleration[:, rows] = x, v, a
            axis[:, rows] = segment.axis[:, None]
        for creep in self.creeps:
            for turn, side in zip(self.turns, self._sides, strict=True):
                x, v, a = creep.at(t, turn, side)
                angle, rate, acceleration = angle + x, rate + v, acceleration + a
        since, progress, position = self._last_turn(t)
        return JointStates(angle, rate, acceleration, axis, since, progress, position)

    def _pieces(self, t: Array) -> Iterator[tuple[slice, _Segment]]:
        starts = [s.start for s in self._segments]
        first = np.searchsorted(t, starts, side="left").tolist()
        for segment, a, b in zip(
            self._segments, first, [*first[1:], len(t)], strict=True
        ):
            if b > a:
                yield slice(a, b), segment

    def _last_turn(self, t: Array) -> tuple[Array, Array, Array]:
        table = np.array([(-np.inf, -np.inf), *self.turns])
        k = np.searchsorted(table[:, 0], t, side="right") - 1
        since = t - table[k, 1]
        length = np.append(1.0, np.diff(table[1:], axis=1))[k]
        progress = np.where(k > 0, np.clip(1 + since / length, 0.0, 1.0), 0.0)
        return since, progress, k.astype(float)


def _polynomial(place: Array, rate: Array) -> Array:
    coefficients = np.zeros((6, JOINTS))
    coefficients[0], coefficients[1] = place, rate
    return coefficients


def _hermite(x0: Array, v0: Array, x1: Array, v1: Array, seconds: float) -> Array:
    c = _polynomial(x0, v0)
    d, dv = x1 - x0 - v0 * seconds, (v1 - v0) * seconds
    c[3] = (10 * d - 4 * dv) / seconds**3  # (j2)
    c[4] = (-15 * d + 7 * dv) / seconds**4  # (j3)
    c[5] = (6 * d - 3 * dv) / seconds**5  # (j4)
    return c


def _evaluate(c: Array, s: Array) -> tuple[Array, Array, Array]:
    """Angles, rates and accelerations (4, n) of the polynomials `c` at `s`, (j1)."""
    if not np.any(c[1:]):
        still = np.zeros((JOINTS, len(s)))
        return c[0][:, None] + still, still, still
    c0, c1, c2, c3, c4, c5 = c[..., None]
    x = c0 + s * (c1 + s * (c2 + s * (c3 + s * (c4 + s * c5))))
    v = c1 + s * (2 * c2 + s * (3 * c3 + s * (4 * c4 + s * 5 * c5)))
    a = 2 * c2 + s * (6 * c3 + s * (12 * c4 + s * 20 * c5))
    return x, v, a
