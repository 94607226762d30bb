"""Whether residuals are larger than the windows' noise explains, and by how much.

    P(chi2 >= X | dof) = Q(dof / 2, X / 2)

Where the positions scatter more than their windows say (a bias that wanders, a fixture
that does not return, an effect left out), an extra variance t^2 common to all positions
is estimated from chi2(t) = dof, and the intervals rest on it. An uncertainty estimated
from few degrees of freedom is itself uncertain: the stated one is enlarged by the ratio
of Student's and the normal 97.5 % points, so that value ± 1.96 sigma still covers 95 %.
Source: Paule and Mandel 1982, for t; JCGM 100:2008, annex G, for the ratio.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fieldcal.gravity import G0
from fieldcal.samples import UNITS, Array
from fieldcal.solve.estimate import Estimate
from fieldcal.solve.observations import Observations

UNLIKELY = 0.01
"""Probability of a larger chi2 from which the scatter counts as beyond the noise."""

STEPS = 40
CLOSE = 1e-3
"""Relative error of chi2 at which the extra scatter counts as found."""

NORMAL = 1.959963984540054
"""97.5 % point of the normal distribution."""


def chance(chi2: Array | float, dof: int) -> float:
    """Probability of a chi2 at least as large when only the stated noise acts."""
    from scipy.special import gammaincc

    return float(gammaincc(dof / 2, float(chi2) / 2)) if dof > 0 else 1.0


def student_ratio(dof: int) -> float:
    """Student's 97.5 % point over the normal one.

    >>> round(student_ratio(1), 2), round(student_ratio(10), 2)
    (6.48, 1.14)
    """
    from scipy.special import stdtrit

    return float(stdtrit(dof, 0.975)) / NORMAL


def absorb(
    run: Callable[[Observations], Estimate],
    observations: Observations,
    channels: slice,
    what: str,
) -> Estimate:
    """Run an estimator; where the residual is beyond the noise, widen its intervals.

    chi2 and dof stay those of the stated noise, so that the misfit remains visible.

    Parameters
    ----------
    run : the estimator
    observations : what it is given
    channels : `observations.ACC` or `observations.GYR`
    what : what scatters, for the warning

    """
    first = run(observations)
    if not first.names or chance(first.chi2, first.dof) >= UNLIKELY:
        return first
    variances = np.diagonal(observations.covariance[:, channels, channels], 0, 1, 2)
    spread = extra(
        lambda t: run(observations.scattered(channels, t)).chi2,
        first.dof,
        float(np.sqrt(variances.mean())),
    )
    wide = run(observations.scattered(channels, spread))
    note = excess(what, first.chi2, first.dof, spread, UNITS[channels][0])
    return replace(
        wide,
        covariance=wide.covariance * student_ratio(first.dof) ** 2,
        chi2=first.chi2,
        dof=first.dof,
        warnings=(*wide.warnings, note),
        extra={**wide.extra, "extra_scatter": spread},
    )


def excess(what: str, chi2: float, dof: int, spread: float, unit: str) -> str:
    """Tell the user about scatter beyond the noise."""
    few = "; of so few degrees of freedom it is itself uncertain" if dof < 5 else ""
    return (
        f"the {what} disagree with the model beyond their windows' noise "
        f"(chi2 {chi2:.0f} with dof {dof}): an extra scatter of {spread:.2g} {unit} is "
        f"in the uncertainties{few}, and {_cause(what, spread)}"
    )


def _cause(what: str, spread: float) -> str:
    if what != "positions":
        return "diagnosis can say where it comes from"
    angle = np.rad2deg(spread / G0)
    return (
        f"either the angles are set no better than {angle:.1g}°, or diagnosis can say "
        "what the model leaves out"
    )


def extra(chi2: Callable[[float], float], dof: int, typical: float) -> float:
    """Extra standard deviation t with chi2(t) = dof; 0 if the noise is enough.

    Parameters
    ----------
    chi2 : sum of squares of the fit with variance t^2 added to every mean
    dof : degrees of freedom
    typical : standard uncertainty of the means, where the search starts

    """
    if dof <= 0:
        return 0.0
    # where all means are alike, chi2 goes as 1 / (typical^2 + t^2): one step is exact
    low, t = 0.0, typical * np.sqrt(max(0.0, chi2(0.0) / dof - 1))
    high = np.inf
    for _ in range(STEPS):
        ratio = chi2(float(t)) / dof
        if t == 0 or abs(ratio - 1) < CLOSE:
            break
        low, high = (t, high) if ratio > 1 else (low, t)
        t = 2 * t if np.isinf(high) else (low + high) / 2
    return float(t)
