"""Steps from where a model of the windows stands, when turns want it elsewhere.

With A = J^T J + diag(1/s^2) and g the slope there, what is linear says that squares
change by (p + n)^T A (p + n) - n^T A n over a step p, n = -A^-1 g being Newton's own.
"""

from __future__ import annotations

import numpy as np

from fieldcal.diagnosis.bench import Bench
from fieldcal.diagnosis.fit import Fit
from fieldcal.samples import Array

FAR = 5.0
"""Longest step away from a fit, standard deviations."""

BENT = 1.0
"""By how much squares may part from their linear prediction."""


def ahead(bench: Bench, fit: Fit) -> Array:
    """Newton's step from where a model stands to its optimum, (k,)."""
    _, prior, centre, shape = bench.about(fit.state)
    flat = fit.jacobian.reshape(-1, len(fit.names))
    pull = np.where(shape, 0.0, (fit.values - centre) / prior**2)
    step: Array = fit.covariance @ (flat.T @ fit.white.ravel() - pull)
    return step


def moved(bench: Bench, fit: Fit, step: Array) -> Fit:
    """The model with its columns changed by a step, (k,), or by part of it.

    Beyond FAR standard deviations what is linear here says nothing.
    """
    step = step * min(1.0, FAR / max(float(np.abs(step / fit.sigma).max()), FAR))
    shape = bench.about(fit.state)[3]
    values = fit.values
    step[shape] = np.clip(step[shape], -0.5 * values[shape], values[shape])
    return bench.at(fit, values + step)


def bends(bench: Bench, fit: Fit, there: Fit) -> bool:
    """Whether, at `there`, rows part from what is linear at `fit`."""
    newton = ahead(bench, fit)
    off = there.values - fit.values - newton
    curvature = np.linalg.inv(fit.covariance)
    linear = off @ curvature @ off - newton @ curvature @ newton
    change = _squares(bench, there) - _squares(bench, fit)
    return bool(abs(change - linear) > BENT)


def _squares(bench: Bench, fit: Fit) -> float:
    """S of a model where it stands."""
    _, prior, centre, shape = bench.about(fit.state)
    pull = np.where(shape, 0.0, (fit.values - centre) / prior)
    return float((fit.white**2).sum() + (pull**2).sum())
