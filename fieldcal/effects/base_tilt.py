"""The base is itself tilted, rigidly, under the joints.

    f = A(alpha, beta) A(alpha0, beta0) f_base

alpha0 = about_z_deg, beta0 = about_x_deg: the tilt of the base about z, then about x;
the Earth's rate is tilted with it. In two positions it cannot be told from biases and
scale factors. Source: Avrutov and Pozniak 2023, (15), which adds the angles instead:
that is `angle_offset`.

>>> import numpy as np
>>> x = Experience.at_rest(np.array([0.0]), np.array([0.0]), 10.0)
>>> np.round(BaseTilt().change(x, [0.0, 30.0]).f, 3)  # 30 deg about z: f_x = -10 sin 30
array([[-5.  , -8.66,  0.  ]])
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.frames import direction_cosines
from fieldcal.physics.effect import Motion, Param, Values
from fieldcal.physics.experience import Experience


class BaseTilt(Motion):
    """Rigid tilt of the base."""

    params = (Param("about_x_deg", "deg", 1.5), Param("about_z_deg", "deg", 1.5))
    covariate = "one pattern through all positions"
    decided_by = "positions in which both joints are turned, to either side"
    cure = (
        "Level the base, or take positions with both joints turned and let "
        "solve estimate it (--tilt base_tilt)."
    )
    source = "Avrutov and Pozniak 2023, (15), composed as matrices; 0.1 to 3 deg"
    order = 1

    def applies(self, x: Experience) -> bool:
        """Where angles are known."""
        return bool(x.oriented.any())

    def change(self, x: Experience, values: Values) -> Experience:
        """Turn the base's vectors before the joints do."""
        about_x, about_z = np.deg2rad(values)
        tilt = direction_cosines(about_z, about_x)
        return x.turned(base_force=tilt @ x.base_force, base_rate=tilt @ x.base_rate)
