"""Each position's angles are a little off, at random.

    f_p = A(alpha_p + a_p, beta_p + b_p) f_base,    a_p, b_p ~ N(0, sigma^2)

No equation, but a direction: the scatter from position to position lies along
df/dalpha and df/dbeta and leaves |f| alone. It widens the intervals. Source: model of
this project; 0.02 to 0.5 deg by eye and hand.

>>> import numpy as np
>>> x = Experience.at_rest(np.array([0.0]), np.array([0.0]), 10.0)
>>> factor = AngleSetting().factor(x, "sigma_deg")[0, :3]
>>> np.round(np.rad2deg(factor), 3) + 0.0  # a turns f towards -x, b towards +z
array([[-10.,   0.],
       [  0.,   0.],
       [  0.,  10.]])
"""

from __future__ import annotations

import numpy as np

from fieldcal.effects import Experience, Param, Scatter
from fieldcal.samples import Array

STEP = 1e-5


class AngleSetting(Scatter):
    """Random error of each position's angles."""

    kind = "motion"
    params = (Param("sigma_deg", "deg", 0.5),)
    covariate = "scatter from position to position along df/dalpha and df/dbeta"
    decided_by = "the same positions taken again: what is random does not come back"
    source = "model of this project; 0.02 to 0.5 deg by eye and hand"

    def factor(self, x: Experience, name: str) -> Array:
        """Two columns a position, m/s^2 (and rad/s) per degree."""
        held = np.unique(x.position[x.position >= 0])
        out = np.zeros((len(x), 6, 2 * len(held)))
        for joint, angle in enumerate(("alpha", "beta")):
            up = x.turned(**{angle: getattr(x, angle) + STEP})
            down = x.turned(**{angle: getattr(x, angle) - STEP})
            change = np.hstack([up.f - down.f, up.w - down.w]) / (2 * STEP)
            for column, p in enumerate(held):
                rows = x.position == p
                out[rows, :, 2 * column + joint] = np.deg2rad(change[rows])
        return out
