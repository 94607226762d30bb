"""Positions an operator can be asked to hold, and the sets that procedures use."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from fieldcal.core.frames import force
from fieldcal.core.samples import Array


@dataclass(frozen=True, slots=True)
class Position:
    """Where the device is held; angles in rad, None where they are not known.

    Attributes
    ----------
    name : shown to the operator
    alpha, beta : turns (1), (2) from home, rad
    rate : constant rate about the procedure axes on a rate table, rad/s
    gamma : third turn, rad
    sigma : how well all this is known, rad about any axis; None if the site says so
    speed : of a table that turns the device about an axis nobody knows, rad/s
    speed_sigma : how well that is known, rad/s

    """

    name: str
    alpha: float | None = None
    beta: float | None = None
    rate: tuple[float, float, float] | None = None
    gamma: float = 0.0
    sigma: float | None = None
    speed: float = 0.0
    speed_sigma: float = 0.0

    @classmethod
    def deg(
        cls, alpha: float, beta: float, name: str = "", gamma: float = 0.0
    ) -> Position:
        """Position from angles in degrees."""
        third = f", γ = {gamma:g}°" if gamma else ""
        return cls(
            name or f"α = {alpha:g}°, β = {beta:g}°{third}",
            float(np.deg2rad(alpha)),
            float(np.deg2rad(beta)),
            gamma=float(np.deg2rad(gamma)),
        )

    def times(self, size: float) -> Position:
        """The same with angles that are so many times as large."""
        if self.alpha is None or self.beta is None:
            return self
        alpha, beta, gamma = (size * a for a in (self.alpha, self.beta, self.gamma))
        return replace(self, alpha=alpha, beta=beta, gamma=gamma)

    @property
    def oriented(self) -> bool:
        """Whether both angles are known."""
        return self.alpha is not None and self.beta is not None

    @property
    def turning(self) -> bool:
        """Whether a table turns the device."""
        return self.speed > 0 or any(self.rate or ())

    @property
    def all_degrees(self) -> tuple[float, float, float] | None:
        """All three angles in degrees, if known."""
        if self.alpha is None or self.beta is None:
            return None
        angles = np.rad2deg([self.alpha, self.beta, self.gamma]).round(9) + 0.0
        alpha, beta, gamma = angles.tolist()
        return alpha, beta, gamma

    @property
    def degrees(self) -> tuple[float, float] | None:
        """Both angles in degrees, if known and all that there is to the position."""
        if self.alpha is None or self.beta is None or self.gamma:
            return None
        alpha, beta = np.rad2deg([self.alpha, self.beta]).round(9).tolist()
        return alpha, beta


def rates(positions: Sequence[Position]) -> Array:
    """Known rates of a rate table, (n, 3) rad/s about the procedure axes; else 0."""
    return np.array([p.rate or (0.0, 0.0, 0.0) for p in positions]).reshape(-1, 3)


def speeds(positions: Sequence[Position]) -> tuple[Array, Array]:
    """Speeds about axes that nobody knows and their ±, (n,) rad/s each; 0 elsewhere."""
    both = [(p.speed, p.speed_sigma) for p in positions]
    table = np.array(both, dtype=float).reshape(-1, 2)
    return table[:, 0], table[:, 1]


def angles(positions: Sequence[Position]) -> tuple[Array, Array]:
    """Alpha and beta of the positions, (n,) rad each, nan where unknown."""
    both = [(p.alpha, p.beta) for p in positions]
    table = np.array(both, dtype=float).reshape(-1, 2)
    return table[:, 0], table[:, 1]


def third_angles(positions: Sequence[Position]) -> Array:
    """Gamma of the positions, (n,) rad."""
    return np.array([p.gamma for p in positions], dtype=float)


def attitude_sigmas(positions: Sequence[Position]) -> Array:
    """How well each position says that it is known, (n,) rad; nan where it does not."""
    return np.array([p.sigma for p in positions], dtype=float)


def forces(positions: Sequence[Position], gravity: float) -> Array:
    """Specific force at rest in procedure axes, (n, 3) m/s^2, nan where unknown."""
    gamma = third_angles(positions)
    return force(*angles(positions), gravity, gamma if gamma.any() else None)


def ladder(positions: Sequence[Position]) -> list[tuple[float, float]]:
    """Angles that a session's ladder can be set to, deg: each it had, to either side.

    >>> ladder([Position.deg(0, 0), Position.deg(45, 5)])[:4]
    [(0.0, 0.0), (0.0, -5.0), (0.0, 5.0), (-45.0, 0.0)]
    """
    had = [p.degrees for p in positions if p.degrees]
    joints = []
    for angles in zip(*had, strict=True) if had else ():
        sizes = {round(abs(a), 6) for a in angles} | {0.0}
        joints.append(sorted({s * a for a in sizes for s in (-1.0, 1.0)}, key=abs))
    return [(a + 0.0, b + 0.0) for a, b in product(*joints)] if joints else []


def _set(*pairs: tuple[float, float]) -> tuple[Position, ...]:
    return tuple(Position.deg(alpha, beta) for alpha, beta in pairs)


TWO = _set((0, 0), (45, 5))
"""The paper's two positions: bias and scale factor on a level base."""

FIVE = _set((0, 0), (22.5, 0), (22.5, 2.5), (45, 2.5), (45, 5))
"""The paper's five positions: the tilt of the base as well."""

WIDE = _set((-45, -5), (-45, 5), (0, 0), (45, -5), (45, 5))
"""Five positions that use the whole of a small ladder, to both sides."""

SIX_FACES = _set((0, 0), (180, 0), (90, 0), (-90, 0), (0, 90), (0, -90))
"""Each axis up and down; needs more than a ladder."""

SETS = {"two": TWO, "five": FIVE, "wide": WIDE, "six_faces": SIX_FACES}
