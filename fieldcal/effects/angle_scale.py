"""The gauge of the angles has a scale error.

    f = A(alpha (1 + a), beta (1 + b)) f_base

Source: model of this project; protractors and stepped ladders show 0.1 to 3 %.

>>> import numpy as np
>>> x = Experience.at_rest(np.array([np.pi / 3]), np.array([0.0]), 10.0)
>>> np.round(AngleScale().change(x, [0.5, 0.0]).f, 3) + 0.0  # 60 deg become 90
array([[-10.,   0.,   0.]])
"""

from __future__ import annotations

from fieldcal.physics.effect import Motion, Param, Values
from fieldcal.physics.experience import Experience


class AngleScale(Motion):
    """Scale error of the two angles."""

    params = (Param("alpha", "1", 3e-2), Param("beta", "1", 3e-2))
    covariate = "size of the angle"
    decided_by = "larger angles, to either side"
    cure = (
        "Check the protractor or the steps of the ladder against a level; use "
        "smaller angles meanwhile."
    )
    source = "model of this project; 0.1 to 3 % on protractors and stepped ladders"
    order = 2

    def applies(self, x: Experience) -> bool:
        """Where angles are known."""
        return bool(x.oriented.any())

    def change(self, x: Experience, values: Values) -> Experience:
        """Stretch the angles."""
        a, b = values
        return x.turned(alpha=x.alpha * (1 + a), beta=x.beta * (1 + b))
