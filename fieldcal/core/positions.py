"""Positions an operator can be asked to hold, and the sets that procedures use."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from fieldcal.core.frames import specific_force_at_rest
from fieldcal.core.samples import Array


@dataclass(frozen=True, slots=True)
class Position:
    """Orientation in which the device is held; angles in rad, None where not known.

    Attributes
    ----------
    name : shown to the operator
    alpha, beta : turns (1), (2) from home, rad
    rate : constant rate about the procedure axes on a rate table, rad/s
    gamma : third turn, rad
    sigma : standard deviation of the attitude about any axis, rad; None where the site
        states it for all positions
    speed : rate of a table that turns the device about an unknown axis, rad/s
    speed_sigma : standard deviation of `speed`, rad/s

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

    def scaled(self, size: float) -> Position:
        """The same position with all angles multiplied by `size`."""
        if self.alpha is None or self.beta is None:
            return self
        alpha, beta, gamma = (size * a for a in (self.alpha, self.beta, self.gamma))
        return replace(self, alpha=alpha, beta=beta, gamma=gamma)

    @property
    def oriented(self) -> bool:
        """Whether both angles are known."""
        return self.alpha is not None and self.beta is not None

    @property
    def on_turning_table(self) -> bool:
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
        """Alpha and beta in degrees; None if unknown or with a third angle."""
        if self.alpha is None or self.beta is None or self.gamma:
            return None
        angles = np.rad2deg([self.alpha, self.beta]).round(9) + 0.0  # no -0.0
        alpha, beta = angles.tolist()
        return alpha, beta

    def turned(self, alpha: float, beta: float) -> Position:
        """The position with both angles further by so much, rad; unknown ones are 0."""
        alpha, beta = (self.alpha or 0.0) + alpha, (self.beta or 0.0) + beta
        return replace(self, alpha=alpha, beta=beta)


def table_rates(positions: Sequence[Position]) -> Array:
    """Rates of a rate table about the procedure axes, (n, 3) rad/s; 0 if not stated."""
    return np.array([p.rate or (0.0, 0.0, 0.0) for p in positions]).reshape(-1, 3)


def unknown_axis_speeds(positions: Sequence[Position]) -> tuple[Array, Array]:
    """Speeds about unknown axes and their ±, (n,) rad/s each; 0 where not stated."""
    both = [(p.speed, p.speed_sigma) for p in positions]
    table = np.array(both, dtype=float).reshape(-1, 2)
    return table[:, 0], table[:, 1]


def alpha_beta_angles(positions: Sequence[Position]) -> tuple[Array, Array]:
    """Alpha and beta of the positions, (n,) rad each, nan where unknown."""
    both = [(p.alpha, p.beta) for p in positions]
    table = np.array(both, dtype=float).reshape(-1, 2)
    return table[:, 0], table[:, 1]


def gamma_angles(positions: Sequence[Position]) -> Array:
    """Gamma of the positions, (n,) rad."""
    return np.array([p.gamma for p in positions], dtype=float)


def attitude_sigmas(positions: Sequence[Position]) -> Array:
    """Standard deviation of each position's attitude, (n,) rad; nan if not stated."""
    return np.array([p.sigma for p in positions], dtype=float)


def specific_forces(positions: Sequence[Position], gravity: float) -> Array:
    """Specific force at rest in procedure axes, (n, 3) m/s^2, nan where unknown."""
    gamma = gamma_angles(positions)
    return specific_force_at_rest(
        *alpha_beta_angles(positions), gravity, gamma if gamma.any() else None
    )


def ladder_settings(positions: Sequence[Position]) -> list[tuple[float, float]]:
    """Pairs of angles that a session's ladder can be set to, deg.

    Each angle that a position has, to either side, and 0.

    >>> ladder_settings([Position.deg(0, 0), Position.deg(45, 5)])[:4]
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


TWO_POSITIONS = _set((0, 0), (45, 5))
"""The paper's two positions: bias and scale factor on a level base."""

FIVE_POSITIONS = _set((0, 0), (22.5, 0), (22.5, 2.5), (45, 2.5), (45, 5))
"""The paper's five positions: the tilt of the base as well."""

WIDE_POSITIONS = _set((-45, -5), (-45, 5), (0, 0), (45, -5), (45, 5))
"""Five positions that use the whole of a small ladder, to both sides."""

SIX_FACES = _set((0, 0), (180, 0), (90, 0), (-90, 0), (0, 90), (0, -90))
"""Each axis up and down; needs more than a ladder."""

POSITION_SETS = {
    "two": TWO_POSITIONS,
    "five": FIVE_POSITIONS,
    "wide": WIDE_POSITIONS,
    "six_faces": SIX_FACES,
}
