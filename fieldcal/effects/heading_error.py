"""The fixture's z axis does not point north.

    w_base = Omega (cos phi sin psi, -sin phi, cos phi cos psi)

w_base, rad/s, procedure axes; phi the latitude, psi the heading error. Needs
gyroscopes that see the Earth. Source: Avrutov and Pozniak 2023, (38), turned about
the vertical.

>>> import numpy as np
>>> x = Experience.at_rest(np.zeros(1), np.zeros(1), 9.8, latitude=0.0)
>>> x = x.turned(base_rate=np.array([0.0, 0.0, 7e-5]))
>>> np.round(HeadingError().change(x, [30.0]).w * 1e5, 3) + 0.0
array([[3.5  , 0.   , 6.062]])
"""

from __future__ import annotations

import numpy as np

from fieldcal.physics.effect import Motion, Param, Values
from fieldcal.physics.experience import Experience


class HeadingError(Motion):
    """Heading of the fixture."""

    params = (Param("psi_deg", "deg", 15.0),)
    covariate = "horizontal Earth rate"
    decided_by = "positions that turn a gyroscope from east to west"
    cure = (
        "Point the fixture north by two bearings instead of a compass, or tell "
        "solve how well (--heading)."
    )
    source = "Avrutov and Pozniak 2023, (38); 1 to 30 deg by compass or eye"
    order = 0

    def applies(self, x: Experience) -> bool:
        """Where the gyroscopes see the Earth, and angles are known."""
        return bool(x.base_rate.any() and x.oriented.any())

    def change(self, x: Experience, values: Values) -> Experience:
        """Turn the Earth's rate about the vertical, y."""
        (psi,) = np.deg2rad(values)
        c, s = np.cos(psi), np.sin(psi)
        east, down, north = x.base_rate
        rate = np.array([c * east + s * north, down, c * north - s * east])
        return x.turned(base_rate=rate)
