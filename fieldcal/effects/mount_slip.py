"""The device slips in its mount: from an instant on it is held otherwise.

    f' = f - theta x f,    w' = w - theta x w    (t >= t_0)

t_0 = at_s, device time, s; theta is small, about the axes of the device, which the
slip turns with it: it is the same in every position and on the way between two, where a
`base_step` is along other axes of the device each time. A mean over the instant has its
part. The slip itself is left out as a bump, and a turn during which the device slips
closes less well.

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

from collections.abc import Mapping

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.effects.bias_step import BiasStep
from fieldcal.physics.effect import NO_SHAPE, Param, Separable
from fieldcal.physics.experience import Experience
from fieldcal.physics.shape import Shape
from fieldcal.physics.turned_outputs import change_by_turn


class MountSlip(Separable):
    """Jump of the attitude of the device on what holds it."""

    params = (
        Param("about_x_deg", "deg", 0.3),
        Param("about_y_deg", "deg", 0.3),
        Param("about_z_deg", "deg", 0.3),
    )
    shapes = (Shape("at_s", "s", -np.inf, np.inf, "instant"),)
    nonlinear = True
    covariate = "time, along the force that is felt"
    seen_in = "time"
    decided_by = "a position from before the slip once more"
    cure = (
        "Fasten the device in its mount, and repeat the positions from before the "
        "slip: all angles are then those of one mounting."
    )
    source = "adhesive tape that creeps, a clamp that is loose; 0.02 to 2 deg"

    def applies(self, x: Experience) -> bool:
        """Where the angles of more than one position are known."""
        return len(np.unique(x.position[x.oriented & (x.position >= 0)])) > 1

    def chance(self, x: Experience) -> float:
        """Of three hundred sessions one has a slip that nobody noticed."""
        return 3e-3

    def course(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """Step function: 0 before the instant, 1 after it."""
        return BiasStep().course(x, shape)

    def pattern(self, x: Experience) -> Array:
        """Change of the outputs for a degree about each axis, (n, 6, 3)."""
        turned = [-np.cross(np.eye(3), v[:, None, :]) for v in (x.f, x.w)]
        out: Array = np.swapaxes(np.concatenate(turned, axis=2), 1, 2)
        out *= np.deg2rad(1.0)
        return out

    def change_of_outputs(
        self, x: Experience, values: Array, shape: Mapping[str, float] = NO_SHAPE
    ) -> Array:
        """Change by the whole rotation: of one degree, 0.15 mg are of second order."""
        turn = np.broadcast_to(np.deg2rad(values), x.f.shape)
        return change_by_turn(x.f, x.w, turn) * self.course(x, shape)[:, None]
