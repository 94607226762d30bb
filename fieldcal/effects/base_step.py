"""The base is knocked: from an instant on it stands otherwise.

    f' = f - theta e x f,    w' = w - theta e x w    (t >= t_0)

t_0 = at_s, device time, s; theta is small, about x or z of the base, e that axis in
those of the device, so that this is a `base_tilt` from an instant on. A mean over the
instant has its part. To one position it is a jump of the biases; each further one shows
it along other axes of the device. The knock itself is left out as a bump, and a turn
during which the base goes over closes less well.

A position whose angles nobody knows shows it only if it happens there: the force turns
about two axes across it, and keeps its length. Source: kinematics of a small rotation
(Titterton and Weston 2004, 3.6); a table that is pushed, a tripod that is kicked.

>>> import numpy as np
>>> x = Experience.at_rest(np.zeros(2), np.zeros(2), 10.0, t=np.array([9.0, 11.0]))
>>> by = BaseStep().design(x, {"at_s": 10.0})  # of one degree each
>>> np.round(by[:, [0, 2]], 4) + 0.0
array([[[ 0.    ,  0.    ],
        [ 0.    ,  0.    ]],
<BLANKLINE>
       [[ 0.    , -0.1745],
        [ 0.1745,  0.    ]]])
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array
from fieldcal.physics.attitude_step import AttitudeStep, at_rest_in_known_position
from fieldcal.physics.effect import Param
from fieldcal.physics.experience import Experience


class BaseStep(AttitudeStep):
    """Jump of the tilt of the base."""

    params = (Param("about_x_deg", "deg", 0.3), Param("about_z_deg", "deg", 0.3))
    turns_device = True
    covariate = "time, along what a tilt of the base does in each position"
    decided_by = "a position from before the knock once more"
    cure = (
        "Fix the base, and repeat the positions from before the knock: tilt and "
        "biases are then those of one base."
    )
    source = "a table that is pushed, a tripod that is kicked; 0.02 to 1 deg"

    def chance(self, x: Experience) -> float:
        """Of three hundred sessions one has a knock that nobody noticed."""
        return 3e-3

    def axes(self, x: Experience) -> Array:
        """Level axes of the base; where no angles are known, two across the force."""
        known = at_rest_in_known_position(x)
        rows = np.flatnonzero(known | _at_rest_in_free_position(x))
        out = np.zeros((len(x), 3, 2))
        if len(rows):
            out[rows] = np.where(
                known[rows, None, None],
                x.to_device_in(rows)[:, :, [0, 2]],
                _axes_across(x.f[rows]),
            )
        return out

    def rate(self, x: Experience) -> Array:
        """The Earth's rate; what a rate table adds is tilted with the base."""
        return np.where(x.rate.any(axis=1, keepdims=True), 0.0, x.w)


def _at_rest_in_free_position(x: Experience) -> NDArray[np.bool_]:
    """Rows at rest whose angles nobody knows."""
    held: NDArray[np.bool_] = ~x.oriented & (x.position >= 0) & ~x.rate.any(axis=1)
    return held


def _axes_across(f: Array) -> Array:
    """Two axes across each force, in those of the device, (n, 3, 2)."""
    up = f / np.maximum(np.linalg.norm(f, axis=1, keepdims=True), 1e-12)
    one = np.cross(up, np.eye(3)[np.argmin(np.abs(up), axis=1)])
    one /= np.maximum(np.linalg.norm(one, axis=1, keepdims=True), 1e-12)
    return np.stack([one, np.cross(one, up)], axis=2)
