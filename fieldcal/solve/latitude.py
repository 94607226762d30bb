"""The stated latitude, compared with the Earth's rate that the gyroscopes measure.

The vertical part of the Earth's rate changes with the attitude as gravity does. If the
positions are inclined enough, it can therefore be distinguished from the biases:

    U sin(phi) = U sin(stated) - d,    d ~ N(0, U^2)                               (1)

A latitude of the wrong sign is not visible otherwise, since gravity is the same on both
hemispheres. Whether the latitude is wrong is decided as for any cause, by the evidence
of the set with d and without it. A simulated device may have no Earth's rate at all;
this is a third hypothesis, with its own fit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.frames import EARTH_RATE
from fieldcal.model import priors, thresholds
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.evidence.sets import Sets
from fieldcal.solve.parameter_set import ParameterSet


@dataclass(frozen=True, slots=True)
class VerticalEarthRate:
    """The Earth's rate about the vertical, as measured by the gyroscopes.

    Attributes
    ----------
    stated : rate by the stated latitude, rad/s, upwards
    measured, sigma : measured rate and its uncertainty, rad/s
    gain : log odds of another latitude against the stated one

    """

    stated: float
    measured: float
    sigma: float
    gain: float

    @classmethod
    def of(
        cls, parameter_set: ParameterSet, sets: Sets, latitude: float | None
    ) -> VerticalEarthRate | None:
        """Measure by the rows of a set, (1); None if the set has no such column.

        Parameters
        ----------
        parameter_set : the set
        sets : of its rows
        latitude : stated latitude, rad; None if none is stated

        """
        if parameter_set.earth < 0 or latitude is None:
            return None
        column = np.array([parameter_set.earth + 1])  # of the vertical, down
        group = Group(
            "earth", "vertical", column, np.array([EARTH_RATE]), fixed_size=1.0
        )
        other = Cause(
            group.cause, group.part, priors.WRONG_LATITUDE_CHANCE, (group,), "given"
        )
        as_said = sets.evaluate(parameter_set.members)
        free = sets.evaluate((*parameter_set.members, (other, group)))
        at = free.state.columns == column[0]
        stated = EARTH_RATE * float(np.sin(latitude))
        return cls(
            stated,
            stated - float(free.state.estimate[at].sum()),
            float(np.sqrt(free.state.inverse[np.ix_(at, at)].sum())),
            free.score - as_said.score,
        )

    @property
    def other_favoured(self) -> bool:
        """Whether the evidence favours another latitude, possible or not."""
        return self.gain > float(np.log(priors.WRONG_LATITUDE_CHANCE))

    @property
    def latitude_wrong(self) -> bool:
        """Whether another latitude is probable, with a rate possible on the Earth."""
        beyond = abs(self.measured) - EARTH_RATE
        named = np.log(thresholds.NAMED / (1 - thresholds.NAMED))
        return self.gain > float(named) and beyond < 2 * self.sigma

    @property
    def sentence(self) -> str:
        """The contradiction, and the remedy."""
        sine = np.clip(self.measured / EARTH_RATE, -1.0, 1.0)
        degrees, stated = (
            np.rad2deg(np.arcsin(s)) for s in (sine, self.stated / EARTH_RATE)
        )
        return (
            f"the gyroscopes show the Earth's rate of latitude {degrees:.0f}°"
            f" ({self.measured:.2g} ± {self.sigma:.1g} rad/s about the vertical), not"
            f" of {stated:.4g}°: south is negative; mend latitude_deg in [site], or the"
            " signs of the gyroscopes' axes, and solve again"
        )
