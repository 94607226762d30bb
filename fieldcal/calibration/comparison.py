"""Whether two calibrations of a device differ by more than their uncertainties.

    d = a - b,  C = C_a + C_b,  z_i = d_i / sqrt(C_ii),  chi2 = d^T C^-1 d

for the parameters that both have. The two are taken as independent, which calibrations
from different recordings are. Where C has no inverse, chi2 is that of the combinations
that have an uncertainty. A parameter that both know exactly has z = 0 if it is the same
in both; if not, z and chi2 are infinite.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.probability import chi2_tail
from fieldcal.core.samples import Array

if TYPE_CHECKING:
    from fieldcal.calibration.parameters import Calibration

SIGNIFICANT = 3.0
"""Standard uncertainties beyond which a single difference is significant."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """Differences of two calibrations.

    Attributes
    ----------
    names : (k,) parameters that both have
    difference, sigma : (k,) first less second, and its standard uncertainty
    chi2, dof : of all differences together; dof is the rank of C
    chance : probability of such a chi2 if nothing has changed
    only_first, only_second : parameters that one of them lacks

    """

    names: tuple[str, ...]
    difference: Array
    sigma: Array
    chi2: float
    dof: int
    chance: float
    only_first: tuple[str, ...]
    only_second: tuple[str, ...]

    @property
    def z(self) -> Array:
        """Each difference in standard uncertainties, (k,)."""
        exact = np.where(
            self.difference == 0, 0.0, np.copysign(np.inf, self.difference)
        )
        known = self.sigma > 0
        return np.where(known, self.difference / np.where(known, self.sigma, 1), exact)

    @property
    def changed(self) -> tuple[str, ...]:
        """Parameters that differ by more than `SIGNIFICANT`."""
        return tuple(
            n for n, z in zip(self.names, self.z, strict=True) if abs(z) > SIGNIFICANT
        )


def compare(first: Calibration, second: Calibration) -> Comparison:
    """Compare two calibrations, parameter by parameter and as a whole.

    Raises
    ------
    InputError
        If they have no parameter in common, or one in different units.

    """
    common = [n for n in first.names if n in second.names]
    if not common:
        raise InputError("the two calibrations have no parameter in common")
    i = [first.names.index(n) for n in common]
    j = [second.names.index(n) for n in common]
    for name, a, b in zip(common, i, j, strict=True):
        if first.units[a] != second.units[b]:
            raise InputError(
                f"{name} is in {first.units[a]} here and in {second.units[b]} there"
            )
    d = first.values[i] - second.values[j]
    c = first.covariance[np.ix_(i, i)] + second.covariance[np.ix_(j, j)]
    chi2, dof = _chi2_of_differences(d, c)
    return Comparison(
        tuple(common),
        d,
        np.sqrt(np.diag(c)),
        chi2,
        dof,
        chi2_tail(chi2, dof),
        tuple(n for n in first.names if n not in common),
        tuple(n for n in second.names if n not in common),
    )


def _chi2_of_differences(d: Array, c: Array) -> tuple[float, int]:
    """Chi-squared of differences (k,) with the covariance (k, k), and its rank."""
    sigma = np.sqrt(np.diag(c))
    known = sigma > 0
    s, z = sigma[known], d[known] / sigma[known]
    # scaled, so that rad/s and m/s^2 do not make it look singular
    power, axes = np.linalg.eigh(c[np.ix_(known, known)] / np.outer(s, s))
    apart = power > len(power) * np.finfo(float).eps * power.max(initial=0.0)
    chi2 = float(np.sum((axes[:, apart].T @ z) ** 2 / power[apart]))
    return np.inf if d[~known].any() else chi2, int(apart.sum())
