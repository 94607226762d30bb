"""A change that all three scale factors share: gravity or the device.

Gravity g (1 + r) in place of g makes every scale factor look larger by 1 + r. Whether
one number r explains the changes c of the three, of covariance C, or each changed by
itself, is for the evidence to say,

    ln N(c; 0, C + s^2 1 1^T) - ln N(c; 0, C + s^2 I)                            (1)

with s the usual size of either. Axes that are hardly known say nothing in it, and two
that agree by chance little. The recording cannot decide between gravity and a device
whose scale factors did change alike.
"""

from __future__ import annotations

import numpy as np

from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.result import Found, Quantity
from fieldcal.samples import Array

CLEAR = 6.0
"""Standard deviations of the common change."""

USUAL = 3e-3
"""Relative change of gravity from a wrong site, and of a scale factor."""

RARE = 4.0
"""By how much gravity must be likelier, ln: wrong sites are rare."""

ANOMALY = 5e-5
"""Relative departure of gravity from the normal one that any site has."""

LARGEST = 5e-3
"""More than a wrong site makes of gravity."""


def common_scale(explanation: Explanation) -> Found | None:
    """The error of gravity that would explain the scale factors, if one would."""
    fit = explanation.fit
    nominal = explanation.prepared.source.about.nominal["acc_scale"]
    names = [f"acc_scale.{a}" for a in "xyz"]
    if any(n not in fit.names or n.startswith("gravity") for n in names):
        return None
    at = [fit.names.index(n) for n in names]
    if not fit.determined[at].all():
        return None
    change = fit.values[at] / nominal - 1
    covariance = fit.covariance[np.ix_(at, at)] / np.outer(nominal, nominal)
    weight = np.linalg.inv(covariance)
    one = np.ones(3)
    sigma = 1 / np.sqrt(one @ weight @ one)
    common = float(sigma**2 * (one @ weight @ change))
    if not max(CLEAR * float(sigma), ANOMALY) <= abs(common) <= LARGEST:
        return None
    if _likelier(change, covariance) < RARE:
        return None
    return Found(
        "gravity_error",
        {"relative": Quantity(common, float(sigma), "1")},
        aliases=("acc_scale",),
        evidence={"delta_chi2": (common / float(sigma)) ** 2},
    )


def _likelier(change: Array, covariance: Array) -> float:
    """By how much one change of all is likelier than one of each, (1)."""

    def evidence(spread: Array) -> float:
        total = covariance + USUAL**2 * spread
        squares = float(change @ np.linalg.solve(total, change))
        return -0.5 * (squares + float(np.linalg.slogdet(total)[1]))

    return evidence(np.ones((3, 3))) - evidence(np.eye(3))  # (1)
