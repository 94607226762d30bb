"""Local gravity is not the one assumed.

    f = (1 + r) f assumed

It cannot be told from a change common to the three scale factors, whatever the
positions: it is only ever one of two explanations. Source: WGS84 normal gravity leaves
out the local anomaly, up to 5e-5; a wrong site is up to 3e-3 off.

>>> import numpy as np
>>> x = Experience.at_rest(np.array([0.0]), np.array([0.0]), 10.0)
>>> np.round(GravityError().change(x, [0.001]).f, 6) + 0.0
array([[  0.  , -10.01,   0.  ]])
"""

from __future__ import annotations

import numpy as np

from fieldcal.physics.effect import Motion, Param, Values
from fieldcal.physics.experience import Experience


class GravityError(Motion):
    """Relative error of gravity."""

    params = (Param("relative", "1", 3e-3),)
    covariate = "scale factors of all three axes together"
    decided_by = "gravity at the site from a survey, or a calibration somewhere else"
    cure = "Give latitude and height of the site, or its surveyed gravity."
    source = "NIMA TR8350.2; up to 3e-3 for a wrong latitude and height"
    order = 0
    like_calibration = "acc_scale"

    def chance(self, x: Experience) -> float:
        """A site that was not stated is common."""
        return 0.05

    def change(self, x: Experience, values: Values) -> Experience:
        """Lengthen the specific force."""
        (relative,) = values
        free = np.where(x.oriented, 1.0, 1.0 + relative)[:, None]
        return x.turned(base_force=x.base_force * (1 + relative), f=x.f * free)
