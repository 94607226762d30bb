"""When each joint of a fixture was last turned, from which side, and about which axis.

A joint has play, gives way and creeps by the side from which it came. The axes follow
from the order of the turns: alpha about z of the base, beta about x of what alpha has
turned, then gamma. Source: kinematics of small rotations, as Titterton and Weston 2004,
3.6.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from fieldcal.core.frames import in_axes_turned_about_y, in_procedure_axes
from fieldcal.core.samples import Array, Index

ANGLE_TOLERANCE_RAD = 1e-8
"""Difference up to which two angles are the same, rad."""


@dataclass(frozen=True, slots=True)
class JointTurns:
    """The turns of a session whose joints are known.

    Attributes
    ----------
    at : (m,) instants at which the turns ended, s of device time, ascending
    side : (m, 2) of alpha and beta: 1 if the angle rose, -1 if it fell, 0 if it stayed
        or nobody knows
    angles : (m, 3) rad to which alpha, beta and gamma were turned

    """

    at: Array
    side: Array
    angles: Array

    @classmethod
    def none(cls) -> Self:
        """No known turns."""
        return cls(np.zeros(0), np.zeros((0, 2)), np.zeros((0, 3)))

    @classmethod
    def of(cls, at: Array, angles: Array) -> Self:
        """Turns between successive positions.

        Parameters
        ----------
        at : (p,) s, when the device came to rest in each; of the first it is not used
        angles : (p, 3) rad; nan where not known

        >>> angles = np.array([[0, 0, 0], [0.5, 0, 0], [0.5, -0.1, 0]])
        >>> JointTurns.of(np.array([-np.inf, 20.0, 40.0]), angles).side.tolist()
        [[1.0, 0.0], [0.0, -1.0]]
        """
        moved = np.diff(angles[:, :2], axis=0)
        side = np.where(np.abs(moved) > ANGLE_TOLERANCE_RAD, np.sign(moved), 0.0)
        known = np.isfinite(moved).all(axis=1) & np.isfinite(at[1:])
        return cls(at[1:][known], side[known], np.nan_to_num(angles[1:][known]))

    def axes(self, t: Array, lead: float, mounting: Array) -> Array:
        """Axes of alpha and beta in device axes at some instants, (n, 3, 2).

        Of the last turn that had ended at `t` (n,) s, or ends within `lead` s; of the
        first one before that. `mounting` is P, procedure = P device.
        """
        alpha, beta, gamma = self.angles.T
        about_alpha = in_procedure_axes(alpha, beta, np.array([0.0, 0.0, 1.0]), gamma)
        about_beta = in_axes_turned_about_y(
            np.tile([1.0, 0.0, 0.0], (len(gamma), 1)), gamma
        )
        each = np.stack([about_alpha @ mounting, about_beta @ mounting], axis=2)
        return each[self._last(t, lead)]

    def _last(self, t: Array, lead: float) -> Index:
        last: Index = np.searchsorted(self.at, t + lead, side="right") - 1
        return np.maximum(last, 0)
