"""The zeros of the two joints are off.

    f = A(alpha + alpha0, beta + beta0) f_base                                   (15)

Differs from `base_tilt` once both joints turn. Source: Avrutov and Pozniak 2023, (15).

>>> import numpy as np
>>> x = Experience.at_rest(np.array([0.0]), np.array([0.0]), 10.0)
>>> np.round(AngleOffset().change(x, [30.0, 0.0]).f, 3)  # f_x = -10 sin 30
array([[-5.  , -8.66,  0.  ]])
"""

from __future__ import annotations

import numpy as np

from fieldcal.physics.effect import Motion, Param, Values
from fieldcal.physics.experience import Experience


class AngleOffset(Motion):
    """Zero offsets of the joints."""

    params = (Param("alpha0_deg", "deg", 1.5), Param("beta0_deg", "deg", 1.5))
    covariate = "one pattern through all positions"
    decided_by = "positions in which both joints are turned, to either side"
    cure = (
        "Set the zeros of the joints anew, or let solve estimate them (--tilt "
        "angle_offset)."
    )
    source = "Avrutov and Pozniak 2023, (15); 0.1 to 3 deg"
    order = 3

    def applies(self, x: Experience) -> bool:
        """Where angles are known."""
        return bool(x.oriented.any())

    def change(self, x: Experience, values: Values) -> Experience:
        """Add to the angles."""
        alpha0, beta0 = np.deg2rad(values)
        return x.turned(alpha=x.alpha + alpha0, beta=x.beta + beta0)  # (15)
