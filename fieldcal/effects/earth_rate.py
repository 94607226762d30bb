"""The gyroscopes see the Earth turn.

    w = A(alpha, beta) Omega (0, -sin phi, cos phi)                              (39)

w angular rate, rad/s, procedure axes; phi the latitude; no parameter. A base that moves
over the Earth adds what it turns by, (37). Left out of the simulation of tactical
grade. Source: Avrutov and Pozniak 2023, (37) to (39), with y down.

>>> import numpy as np
>>> pole = {"latitude": np.pi / 2, "position": np.zeros(1, int)}
>>> x = Experience.at_rest(np.array([0.0]), np.array([0.0]), 9.8, **pole)
>>> np.round(EarthRate().change(x, []).w * 1e5, 3) + 0.0  # straight up, y is down
array([[ 0.   , -7.292,  0.   ]])
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.frames import earth_rate_at_home
from fieldcal.physics.effect import Motion, Values
from fieldcal.physics.experience import Experience


class EarthRate(Motion):
    """The Earth's rate."""

    covariate = "gyroscope means turn with the position"
    decided_by = "longer windows with the gyroscopes turned end for end"
    cure = (
        'Say grade = "navigation" and the latitude: it becomes the reference of '
        "the gyroscopes."
    )
    source = "Avrutov and Pozniak 2023, (39); 15.04 deg/h"
    order = -1

    def change(self, x: Experience, values: Values) -> Experience:
        """Add the Earth's rate to what turns with the device.

        Raises
        ------
        InputError
            If the latitude is not known.

        """
        if np.isnan(x.latitude):
            raise InputError(
                "[model] has earth_rate, and the latitude is not stated: add"
                " latitude_deg to [site] of session.toml"
            )
        rate = earth_rate_at_home(x.latitude) + x.transport
        return x.turned(base_rate=rate)  # (39)
