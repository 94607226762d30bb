"""The tilt of the base, and what a device on it sees of a vector of the level base.

    none            v = P^T A(a, b) v_home                                  (4), (39)
    angle_offset    v = P^T A(a + a0, b + b0) v_home                            (15)
    base_tilt       v = P^T A(a, b) A(about_z, about_x) v_home

v_home is the specific force (0, -g, 0) or the Earth's rate in axes of a level base, v
the same in device axes, P the mounting, a (alpha) and b (beta) the turns in procedure
axes, rad. angle_offset is an error of the zeros of both turning joints, base_tilt a
base that is tilted itself. Source: Avrutov and Pozniak 2023, with the sign of (5)
corrected.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from fieldcal.frames import turn
from fieldcal.positions import Position, angles
from fieldcal.samples import Array

RAD = np.pi / 180

Tilt = Literal["none", "angle_offset", "base_tilt"]

TILT_NAMES: dict[Tilt, tuple[str, ...]] = {
    "none": (),
    "angle_offset": ("angle_offset.alpha0_deg", "angle_offset.beta0_deg"),
    "base_tilt": ("base_tilt.about_x_deg", "base_tilt.about_z_deg"),
}


@dataclass(frozen=True, slots=True)
class Base:
    """How the base is tilted, as far as that is known.

    Attributes
    ----------
    tilt : the model
    degrees : (2,) in the order of `TILT_NAMES`; (0,) for none
    covariance : (2, 2) of the degrees; (0, 0) for none

    """

    tilt: Tilt = "none"
    degrees: Array = field(default_factory=lambda: np.zeros(0))
    covariance: Array = field(default_factory=lambda: np.zeros((0, 0)))

    @classmethod
    def found(cls, names: Sequence[str], values: Array, covariance: Array) -> Base:
        """The tilt among estimated parameters (p,), covariance (p, p)."""
        for tilt, wanted in TILT_NAMES.items():
            if wanted and set(wanted) <= set(names):
                rows = [list(names).index(name) for name in wanted]
                return cls(tilt, values[rows], covariance[np.ix_(rows, rows)])
        return cls()

    def seen(
        self, home: Array, positions: Sequence[Position], mounting: Array
    ) -> tuple[Array, Array]:
        """A vector of the level base as the device sees it in n positions.

        Returns it, (n, 3), and how far off it is, (n, 3, k): columns of unknown
        factors of mean 0 and variance 1.
        """
        v, by_tilt = tilted(self.tilt, positions, home, mounting, self.degrees)
        return v, by_tilt @ _root(self.covariance)


LEVEL = Base()
"""A base that is taken as exactly level."""


def _root(covariance: Array) -> Array:
    """Matrix R with R R^T the covariance, which need not be of full rank."""
    variance, along = np.linalg.eigh(covariance)
    root: Array = along * np.sqrt(np.maximum(variance, 0.0))
    return root


def tilted(
    tilt: Tilt,
    positions: Sequence[Position],
    home: Array,
    mounting: Array,
    degrees: Array,
) -> tuple[Array, Array]:
    """A vector of the level base in device axes and its derivatives by the tilt.

    Parameters
    ----------
    tilt : the model of the tilt
    positions : n positions with known angles
    home : (3,) specific force or the Earth's rate in axes of a level base
    mounting : (3, 3), procedure = mounting @ device
    degrees : (..., 2) the tilt in the order of `TILT_NAMES`; (..., 0) for none

    Returns
    -------
    v : (..., n, 3) unit of `home`
    by_tilt : (..., n, 3, 2) per degree; (..., n, 3, 0) for none

    """
    alpha, beta = angles(positions)
    to_device: Array = mounting.T
    if tilt == "none":
        v = turn(alpha, beta) @ home @ mounting  # (4)
        each = np.broadcast_to(v, (*degrees.shape[:-1], *v.shape))
        return each, np.zeros((*each.shape, 0))
    first, second = np.moveaxis(np.deg2rad(degrees), -1, 0)[..., None]
    if tilt == "base_tilt":
        to_device = to_device @ turn(alpha, beta)
        alpha, beta = second, first  # the base is turned about z, then about x
    else:
        alpha, beta = alpha + first, beta + second  # (15)
    v = to_device @ (turn(alpha, beta) @ home)[..., None]
    by_alpha = to_device @ (_by_alpha(alpha, beta) @ home)[..., None]
    by_beta = to_device @ (_by_beta(alpha, beta) @ home)[..., None]
    both = (by_beta, by_alpha) if tilt == "base_tilt" else (by_alpha, by_beta)
    return v[..., 0], np.concatenate(both, axis=-1) * RAD


def _by_alpha(a: Array, b: Array) -> Array:
    """Derivative of `turn` by alpha, (..., 3, 3)."""
    flat = np.zeros((3, 3))
    flat[0, 1], flat[1, 0] = 1.0, -1.0
    whole: Array = turn(a, b) @ flat
    return whole


def _by_beta(a: Array, b: Array) -> Array:
    """Derivative of `turn` by beta, (..., 3, 3)."""
    flat = np.zeros((3, 3))
    flat[1, 2], flat[2, 1] = 1.0, -1.0
    whole: Array = flat @ turn(a, b)
    return whole
