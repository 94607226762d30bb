"""A way that the device was carried along, told by angles and followed in between.

The way is given by a(t), the angular rate of the procedure axes summed up in those axes
themselves, at m instants; between them a runs along the cubic spline through them, and

    w(t) = a'(t),  dw(t) = a''(t)                                   (w1)

From one instant to the next the attitude turns by the small angle in between,

    q_k = q_{k-1} (x) (cos |d|/2, d/|d| sin |d|/2),  d = a_k - a_{k-1}   (w2)

which leaves out coning within a step: |d|^3 / 12 at the most, 1e-7 rad for a step of
20 ms at 30 deg/s. Source: strapdown attitude, e.g. Titterton and Weston, Strapdown
Inertial Navigation Technology, chapter 11.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.sim_device.quaternion import STILL, multiply, turn

FEWEST = 4
"""Instants that a cubic spline needs."""

REST = (STILL, np.zeros((3, 1)), np.zeros((3, 1)))
"""Attitude, rate and its derivative of what is not carried anywhere."""


@dataclass(frozen=True)
class Manoeuvre:
    """Motion between two orientations, from rest to rest.

    Attributes
    ----------
    t : (m,) ascending instants, s
    angle : (3, m) a at those, rad

    Raises
    ------
    InputError
        If there are fewer than four instants, or they do not ascend.

    """

    t: Array
    angle: Array

    def __post_init__(self) -> None:
        if len(self.t) < FEWEST or not np.all(np.diff(self.t) > 0):
            raise InputError(
                f"a way needs {FEWEST} instants at least, one after the other"
            )

    def lasts(self, t: Array) -> NDArray[np.bool_]:
        """Whether the device is on its way at instants, (n,)."""
        lasts: NDArray[np.bool_] = (t >= self.t[0]) & (t <= self.t[-1])
        return lasts

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """Attitude against the start (4, n), rate and its derivative (3, n), at (n,) s.

        Instants beyond the ends are those of the ends.
        """
        t = np.clip(t, self.t[0], self.t[-1])
        k = np.clip(np.searchsorted(self.t, t, side="right") - 1, 0, len(self.t) - 2)
        course = self._course
        rest = course(t) - self.angle[:, k]
        attitude = multiply(self._attitudes[:, k], _small(rest))  # (w2)
        return attitude, course(t, 1), course(t, 2)  # (w1)

    @cached_property
    def _course(self) -> Callable[..., Array]:
        from scipy.interpolate import CubicSpline

        course: Callable[..., Array] = CubicSpline(self.t, self.angle, axis=1)
        return course

    @cached_property
    def _attitudes(self) -> Array:
        """Attitudes at the instants of the way, (4, m)."""
        steps = _small(np.diff(self.angle, axis=1))
        out = np.repeat(STILL, len(self.t), axis=1)
        for k in range(steps.shape[1]):
            out[:, k + 1] = multiply(out[:, k], steps[:, k])
        return out


def _small(angle: Array) -> Array:
    """Quaternions (4, n) of small turns by vectors (3, n) rad."""
    size = np.sqrt((angle**2).sum(axis=0))
    return turn(angle / np.where(size > 0, size, 1.0), size)
