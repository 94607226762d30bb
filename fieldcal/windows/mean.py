"""The mean of a still window, with a standard error that holds."""

from __future__ import annotations

from dataclasses import dataclass, replace

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

    def no_better_than(self, noise: Array) -> Average:
        """The same with errors of at least those of samples with some noise, (6,).

        Where there is no error at all, one value is repeated, and nothing known of it.
        """
        sigma = self.sigma
        least = np.where(sigma > 0, noise / np.sqrt(self.n), 0.0)
        wider = np.fmax(1.0, least / np.where(sigma > 0, sigma, 1.0))
        return replace(self, covariance=self.covariance * np.outer(wider, wider))
