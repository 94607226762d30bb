"""Distribution of a parameter from run to run, to judge whether a new value agrees.

A parameter changes from run to run by b_i ~ N(0, tau^2) and is known to sigma_i:

    x_i = mu + b_i + e_i,  e_i ~ N(0, sigma_i^2),  i = 1 ... n

    tau_n^2 = max(0, var x - mean sigma_i^2)                  what n runs tell      (1)
    tau^2 = (nu_0 r^2 + (n - 1) tau_n^2) / (nu_0 + n - 1)     with what is usual    (2)
    w_i = 1 / (tau^2 + sigma_i^2),  m = sum w x / sum w       mean                  (3)
    s^2 = tau^2 + sigma^2 + 1 / sum w                         of a new value        (4)
    z = (x - m) / s ~ t(nu_0 + n - 1)                                               (5)

r is the usual spread for the grade. It counts as nu_0 runs, so that one earlier run is
enough for a comparison. With many runs it has little weight. Units are the parameter's.
Source: (1) is the moment estimate of a random effect (DerSimonian and Laird 1986,
unweighted); (2) the mean of a scaled inverse chi-squared prior's posterior.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array

USUAL_RUNS = 2.0
"""nu_0: number of runs that the usual spread of the grade counts as."""


@dataclass(frozen=True, slots=True)
class FamilySpread:
    """Distribution of a parameter in the next run, from earlier runs.

    Attributes
    ----------
    mean : m
    spread : tau, standard deviation from run to run
    sigma_mean : standard uncertainty of m
    dof : of the t distribution (5)
    runs : n

    """

    mean: float
    spread: float
    sigma_mean: float
    dof: float
    runs: int

    def sigma(self, sigma: float) -> float:
        """Standard deviation of the difference of a new value from the mean, (4)."""
        return float(np.sqrt(self.spread**2 + sigma**2 + self.sigma_mean**2))

    def chance(self, value: float, sigma: float) -> float:
        """Probability of a difference from the mean at least as large, (5)."""
        from scipy.special import stdtr

        z = abs(value - self.mean) / self.sigma(sigma)
        return float(2 * stdtr(self.dof, -z))


def next_run_distribution(values: Array, sigmas: Array, usual: float) -> FamilySpread:
    """Distribution of the next value, from runs (n,) and their uncertainties, (1)-(3).

    `usual` is r. At least one run is needed.
    """
    n = len(values)
    measured = 0.0
    if n > 1:
        measured = max(0.0, float(np.var(values, ddof=1) - np.mean(sigmas**2)))  # (1)
    spread2 = (USUAL_RUNS * usual**2 + (n - 1) * measured) / (USUAL_RUNS + n - 1)  # (2)
    w = 1 / (spread2 + sigmas**2)  # (3)
    return FamilySpread(
        float(w @ values / w.sum()),
        float(np.sqrt(spread2)),
        float(1 / np.sqrt(w.sum())),
        USUAL_RUNS + n - 1,
        n,
    )
