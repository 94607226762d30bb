"""What a model of the rows is: effects, the values of their parameters, prediction.

    U = b + diag(k) f' + sum_e D_e(f', w'; shape) v_e
    W = d + diag(s) w' + sum_e D_e(f', w'; shape) v_e

f', w' are what the motion effects make of f and w. Where the angles of a position are
not known, or are known up to a random error, two small turns of it come first.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from fieldcal.effects import NO_SHAPE, Effect, Experience, Motion, Sensor
from fieldcal.samples import Array


@dataclass(frozen=True, slots=True)
class Term:
    """An effect in a model: which of its parameters are free, and its shape.

    `columns` are indices into the effect's `params`; `start` are the values that the
    simulation has already, to which the estimates are added; `free_shape` says whether
    the shape parameters are estimated as well; `tight` is the size of the prior in
    typical sizes.
    """

    effect: Effect
    columns: tuple[int, ...]
    shape: Mapping[str, float] = field(default_factory=dict)
    free_shape: bool = False
    start: tuple[float, ...] = ()
    tight: float = 1.0

    @property
    def names(self) -> tuple[str, ...]:
        """Names of what is estimated, in the order of the values."""
        free = tuple(self.shape) if self.free_shape else ()
        return tuple(self.effect.params[j].name for j in self.columns) + free

    @property
    def gyro(self) -> bool:
        """Whether it is an effect on the gyroscopes alone."""
        units = [self.effect.params[j].unit for j in self.columns]
        return all(u.startswith(("rad", "(rad")) for u in units) or (
            self.effect.id.startswith("gyro")
        )

    @property
    def prior(self) -> Array:
        """Size that each value can have."""
        sizes = [self.tight * self.effect.params[j].typical for j in self.columns]
        if self.free_shape:
            sizes += list(self.shape.values())
        return np.array(sizes)

    def full(self, values: Array) -> Array:
        """Values of all the effect's parameters, zero where not free."""
        out = np.zeros(len(self.effect.params))
        out[: len(self.start)] = self.start
        out[list(self.columns)] += values[: len(self.columns)]
        return out

    def shaped(self, values: Array) -> Mapping[str, float]:
        """Shape parameters at some values of the parameters."""
        if not self.free_shape:
            return self.shape or NO_SHAPE
        return dict(zip(self.shape, values[len(self.columns) :], strict=True))


@dataclass(frozen=True, slots=True)
class State:
    """Where a model stands: everything that rows need to predict themselves.

    Attributes
    ----------
    bias, scale : (6,)
    terms, values : the effects and the values of their parameters
    aside : (p, 2) small turns of each position, rad

    """

    bias: Array
    scale: Array
    terms: tuple[Term, ...]
    values: tuple[Array, ...]
    aside: Array

    def experienced(self, x: Experience) -> Experience:
        """What the motion effects and the turns aside make of the rows."""
        pairs = zip(self.terms, self.values, strict=True)
        motions = [
            (t.effect, t.full(v)) for t, v in pairs if isinstance(t.effect, Motion)
        ]
        if self.aside.any():
            x = turned_aside(x, self.aside)
        for effect, values in sorted(motions, key=lambda pair: pair[0].order):
            x = effect.change(x, values)
        return x

    def predict(self, x: Experience) -> Array:
        """The six outputs of each row, (n, 6)."""
        return self.output(self.experienced(x))

    def output(self, x: Experience) -> Array:
        """The six outputs of rows as they are experienced, (n, 6)."""
        out: Array = self.bias + self.scale * np.hstack([x.f, x.w])
        for term, values in zip(self.terms, self.values, strict=True):
            if isinstance(term.effect, Sensor):
                design = term.effect.design(x, term.shaped(values))
                out = out + design @ term.full(values)
        return out


def turned_aside(x: Experience, aside: Array) -> Experience:
    """Rows with each position turned a little: (p, 2) rad.

    By alpha and beta where they are known; else about two axes across the force.
    """
    small = aside[np.maximum(x.position, 0)] * (x.position >= 0)[:, None]
    free = ~x.oriented
    x = x.turned(alpha=x.alpha + small[:, 0], beta=x.beta + small[:, 1])
    if free.any():
        f = x.f.copy()
        one, two = across(f[free])
        f[free] += small[free, :1] * one + small[free, 1:] * two
        length = np.linalg.norm(f[free], axis=1, keepdims=True)
        f[free] *= np.linalg.norm(x.f[free], axis=1, keepdims=True) / length
        x = replace(x, f=f)
    return x


def across(f: Array) -> tuple[Array, Array]:
    """Two vectors across each force and as long, (n, 3) each."""
    least = np.eye(3)[np.argmin(np.abs(f), axis=1)]
    one = np.cross(f, least)
    length = np.linalg.norm(f, axis=1, keepdims=True)
    one *= length / np.linalg.norm(one, axis=1, keepdims=True)
    return one, np.cross(f, one) / length
