"""The mean of a still window, with a standard error that holds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array


@dataclass(frozen=True, slots=True)
class Average:
    """Mean of a window in which the device was still.

    Attributes
    ----------
    mean : (6,) m/s^2 and rad/s, in `samples.CHANNELS` order; nan where not measured
    covariance : (6, 6) of `mean`
    temperature : mean temperature, deg C; nan where unknown
    n : samples averaged
    start, end : first and last instant, s of device time

    """

    mean: Array
    covariance: Array
    temperature: float
    n: int
    start: float
    end: float

    @property
    def sigma(self) -> Array:
        """Standard error of each mean, (6,)."""
        return np.sqrt(np.diag(self.covariance))
