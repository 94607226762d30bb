"""A change that all three scale factors share: gravity or the device.

Gravity g (1 + r) in place of g makes every scale factor look larger by 1 + r. If the
three have changed from the nominal ones by the same factor within their uncertainty,
and by more than that, a wrong gravity explains with one number what else takes three.
The recording cannot decide between the two.
"""

from __future__ import annotations

import numpy as np

from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.result import Found, Quantity

CLEAR = 6.0
"""Standard deviations of the common change."""

ALIKE = 6.0
"""Squares (two degrees of freedom) that the three may differ by."""

SHARP = 6.0
"""Standard deviations of the common change in at least two axes by themselves."""

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
    weight = np.linalg.inv(fit.covariance[np.ix_(at, at)] / np.outer(nominal, nominal))
    one = np.ones(3)
    sigma = 1 / np.sqrt(one @ weight @ one)
    common = float(sigma**2 * (one @ weight @ change))
    rest = change - common
    alone = np.abs(change) * np.sqrt(1 / np.diag(np.linalg.inv(weight)))
    if not max(CLEAR * float(sigma), ANOMALY) <= abs(common) <= LARGEST:
        return None
    if rest @ weight @ rest > ALIKE or (alone > SHARP).sum() < 2:
        return None
    return Found(
        "gravity_error",
        {"relative": Quantity(common, float(sigma), "1")},
        aliases=("acc_scale",),
        evidence={"delta_chi2": (common / float(sigma)) ** 2},
    )
