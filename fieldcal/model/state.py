"""The base state, and the outputs that it predicts.

    U = b + diag(k) f' + sum_e D_e(f', w'; psi) v_e,     W = d + diag(s) w' + ...

f', w' are what the small turns of each position, the Earth's rate and the motion
effects make of f and w, in that order. m/s^2, rad/s, device axes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from fieldcal.core.frames import angles_of_direction_cosines, direction_cosines
from fieldcal.core.rotation import rotation_matrices
from fieldcal.core.samples import Array
from fieldcal.physics.effect import NO_SHAPE, Effect, Motion, Sensor
from fieldcal.physics.experience import Experience
from fieldcal.physics.lag import Lag


@dataclass(frozen=True, slots=True, eq=False)
class Term:
    """An effect with its parameters; the same only as itself.

    Attributes
    ----------
    effect : of the catalogue
    values : (k,) all its parameters
    shape : its shape parameters
    origin : index of the instants from which "since the turn" counts

    """

    effect: Effect
    values: Array
    shape: Mapping[str, float] = field(default_factory=dict)
    origin: int = 0

    @property
    def order(self) -> int:
        """Place in which motion effects are applied."""
        return self.effect.order if isinstance(self.effect, Motion) else 0


@dataclass(frozen=True, slots=True)
class State:
    """Parameters from which the rows are predicted.

    Attributes
    ----------
    bias, scale : (6,)
    small_rotation : (p, 2) small rotations of each position, rad
    earth : (3,) rad/s, rate of the base in addition to the known rate
    terms : effects
    attitude : (p, 3) errors of measured attitudes, rad about the axes of the base

    """

    bias: Array
    scale: Array
    small_rotation: Array
    earth: Array
    terms: tuple[Term, ...] = ()
    attitude: Array = field(default_factory=lambda: np.zeros((0, 3)))

    @property
    def lag(self) -> Lag:
        """Delay and time constants of the sensors, by its effects."""
        return sum((t.effect.lag(t.values) for t in self.terms), Lag())

    def experienced(self, x: Experience) -> Experience:
        """Inputs of rows with small rotations, the Earth's rate and motion effects."""
        return self.moved(self.turned(x))

    def turned(self, x: Experience) -> Experience:
        """Inputs of rows with small rotations and the Earth's rate alone."""
        return self.with_earth(self.rotated(x))

    def rotated(self, x: Experience) -> Experience:
        """Inputs of rows with small rotations alone."""
        if self.small_rotation.any():
            x = rotate_positions(x, self.small_rotation)
        if self.attitude.any():
            x = tilt_positions(x, self.attitude)
        return x

    def with_earth(self, x: Experience) -> Experience:
        """Inputs of rows `x` from `rotated` with the Earth's rate."""
        return x.turned(base_rate=x.base_rate + self.earth) if self.earth.any() else x

    def moved(self, x: Experience) -> Experience:
        """Inputs of rows `x` from `turned` with motion effects."""
        for term in sorted(self.terms, key=lambda t: t.order):
            if isinstance(term.effect, Motion):
                x = term.effect.change(x, term.values)
        return x

    def output(self, x: Experience, since: Array) -> Array:
        """The six outputs for inputs `x` from `experienced`, (n, 6).

        `since` (o, n) is the time since the turn, by origin.
        """
        out: Array = self.bias + self.scale * np.hstack([x.f, x.w])
        by_origin: dict[int, Experience] = {}
        for term in self.terms:
            if isinstance(term.effect, Sensor):
                if term.origin not in by_origin:
                    by_origin[term.origin] = replace(x, since_turn=since[term.origin])
                since_origin = by_origin[term.origin]
                change = term.effect.change_of_outputs(
                    since_origin, term.values, term.shape or NO_SHAPE
                )
                out = out + term.effect.gain(self.scale) * change
        return out


def rotate_positions(x: Experience, small_rotation: Array) -> Experience:
    """Rows with a small rotation of each position, (p, 2) rad.

    By alpha and beta if they are known; else about two axes perpendicular to the force,
    or to the rate of a table with an unknown axis.
    """
    small = small_rotation[np.maximum(x.position, 0)] * (x.position >= 0)[:, None]
    # without accelerometers the vertical is not known
    free = ~x.oriented & (np.linalg.norm(x.f, axis=1) > 0)
    x = x.set_off(alpha=x.alpha + small[:, 0], beta=x.beta + small[:, 1])
    if free.any():
        f = x.f.copy()
        f[free] += _sideways(f[free], small[free])
        length = np.linalg.norm(f[free], axis=1, keepdims=True)
        f[free] *= np.linalg.norm(x.f[free], axis=1, keepdims=True) / length
        x = replace(x, f=f)
    spun = x.speed > 0
    if spun.any():
        w = x.w.copy()
        w[spun] += _sideways(w[spun], small[spun])
        w[spun] *= (x.speed[spun] / np.linalg.norm(w[spun], axis=1))[:, None]
        x = replace(x, w=w)
    return x


def _sideways(vectors: Array, angles: Array) -> Array:
    """Change of vectors (n, 3) by small angles (n, 2), rad, in their own unit.

    Along the two vectors perpendicular to each, which are as long as it is.
    """
    one, two = perpendicular_vectors(vectors)
    return angles[:, :1] * one + angles[:, 1:] * two


def tilt_positions(x: Experience, attitude: Array) -> Experience:
    """Rows with a small rotation of each position about the base's axes, (p, 3) rad."""
    moved = np.flatnonzero(attitude.any(axis=1))
    first = np.array([int(np.argmax(x.position == p)) for p in moved])
    present = x.position[first] == moved
    first, moved = first[present], moved[present]
    held = direction_cosines(x.alpha[first], x.beta[first], x.gamma[first])
    angles = angles_of_direction_cosines(
        held @ np.swapaxes(rotation_matrices(attitude[moved]), 1, 2)
    )
    table = np.full((len(attitude) + 1, 3), np.nan)
    table[moved] = angles
    new = table[x.position]
    old = np.column_stack([x.alpha, x.beta, x.gamma])
    alpha, beta, gamma = np.where(np.isnan(new), old, new).T
    return x.set_off(alpha=alpha, beta=beta, gamma=gamma)


def perpendicular_vectors(f: Array) -> tuple[Array, Array]:
    """Two vectors perpendicular to each force and of its length, (n, 3) each."""
    least = np.eye(3)[np.argmin(np.abs(f), axis=1)]
    one = np.cross(f, least)
    length = np.linalg.norm(f, axis=1, keepdims=True)
    one *= length / np.linalg.norm(one, axis=1, keepdims=True)
    return one, np.cross(f, one) / length
