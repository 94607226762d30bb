"""What a unit's parameters are, by the units that it was made with.

    theta ~ (1 - sum p) N(m, P) + sum_j p_j N(m, P + (K^2 - 1) P_jj e_j e_j^T)      (1)

m and P are what its lot says of the next unit: what units differ by, and what is not
known of their mean and spread. A unit may be odd in any one parameter, or in all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array


@dataclass(frozen=True, slots=True)
class LotPrior:
    """What a lot says of its next unit.

    Attributes
    ----------
    label : which lot, as somebody asked for it
    names : (k,) parameters by full name
    mean : (k,) m, in the parameters' units
    covariance : (k, k) P
    odd : (k,) p, chance that a unit is odd in each
    times : K; how much further off an odd one is
    units : (k,) units that each parameter is known of

    """

    label: str
    names: tuple[str, ...]
    mean: Array
    covariance: Array
    odd: Array
    times: float
    units: tuple[int, ...]

    @property
    def sigma(self) -> Array:
        """Standard uncertainty of the next unit's value, (k,)."""
        return np.sqrt(np.diag(self.covariance))

    def only(self, names: Sequence[str]) -> LotPrior:
        """The part of it that is about some parameters, in its own order."""
        at = [i for i, name in enumerate(self.names) if name in names]
        return LotPrior(
            self.label,
            tuple(self.names[i] for i in at),
            self.mean[at],
            self.covariance[np.ix_(at, at)],
            self.odd[at],
            self.times,
            tuple(self.units[i] for i in at),
        )
