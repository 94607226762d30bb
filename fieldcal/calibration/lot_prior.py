"""Prior of a unit's parameters from other units of its production lot.

    theta ~ (1 - sum p) N(m, P) + sum_j p_j N(m, P + (K^2 - 1) P_jj e_j e_j^T)      (1)

m and P are mean and covariance of the next unit: they include the differences between
units, and the uncertainty of mean and spread. A unit may be an outlier in any one
parameter, or in all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array


@dataclass(frozen=True, slots=True)
class LotPrior:
    """Prior of the parameters of the next unit of a lot.

    Attributes
    ----------
    label : the lot, as it was requested
    names : (k,) parameters by full name
    mean : (k,) m, in the parameters' units
    covariance : (k, k) P
    outlier_probability : (k,) p, probability that a unit is an outlier in each
    outlier_factor : K, factor on the standard deviation of an outlier
    units : (k,) number of units with a value of each parameter

    """

    label: str
    names: tuple[str, ...]
    mean: Array
    covariance: Array
    outlier_probability: Array
    outlier_factor: float
    units: tuple[int, ...]

    @property
    def sigma(self) -> Array:
        """Standard uncertainty of the next unit's value, (k,)."""
        return np.sqrt(np.diag(self.covariance))

    def subset(self, names: Sequence[str]) -> LotPrior:
        """The prior of some of the parameters, in its own order."""
        at = [i for i, name in enumerate(self.names) if name in names]
        return LotPrior(
            self.label,
            tuple(self.names[i] for i in at),
            self.mean[at],
            self.covariance[np.ix_(at, at)],
            self.outlier_probability[at],
            self.outlier_factor,
            tuple(self.units[i] for i in at),
        )
