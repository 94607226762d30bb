"""The device slips in its mount: from an instant on it is held otherwise.

    f' = f - theta x f,    w' = w - theta x w    (t >= t_0)

t_0 = at_s, device time, s; theta is small, about the axes of the device. It is the same
in every position and on the way between two, while a `base_step` is along other axes of
the device in each. A mean over the instant has its part. The slip itself is left out as
a bump, and a turn during which the device slips closes less well.

A position whose angles nobody knows shows it only if it happens there: afterwards the
force there is no more known than before. Source: kinematics of a small rotation
(Titterton and Weston 2004, 3.6); adhesive tape that creeps, a clamp that is loose.

>>> import numpy as np
>>> x = Experience.at_rest(np.zeros(2), np.zeros(2), 10.0, t=np.array([9.0, 11.0]))
>>> by = MountSlip().design(x, {"at_s": 10.0})  # of one degree each
>>> np.round(by[1, :3], 4) + 0.0  # the force is along -y
array([[ 0.    ,  0.    , -0.1745],
       [ 0.    ,  0.    ,  0.    ],
       [ 0.1745,  0.    ,  0.    ]])
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.physics.attitude_step import AttitudeStep
from fieldcal.physics.effect import Param
from fieldcal.physics.experience import Experience


class MountSlip(AttitudeStep):
    """Jump of the attitude of the device on what holds it."""

    params = (
        Param("about_x_deg", "deg", 0.3),
        Param("about_y_deg", "deg", 0.3),
        Param("about_z_deg", "deg", 0.3),
    )
    covariate = "time, along the force that is felt"
    decided_by = "a position from before the slip once more"
    cure = (
        "Fasten the device in its mount, and repeat the positions from before the "
        "slip: all angles are then those of one mounting."
    )
    source = "adhesive tape that creeps, a clamp that is loose; 0.02 to 2 deg"

    def chance(self, x: Experience) -> float:
        """Of three hundred sessions one has a slip that nobody noticed."""
        return 3e-3

    def axes(self, x: Experience) -> Array:
        """Those of the device, in every row."""
        return np.broadcast_to(np.eye(3), (len(x), 3, 3))
