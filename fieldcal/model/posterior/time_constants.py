"""The uncertainty of time constants, in which the rows are not linear.

Each time constant tau_i, s, of a set has a standard uncertainty sigma_i. The amplitudes
of the effects that decay with it, and the biases, depend on it nonlinearly. A set with
n time constants is replaced by 2 n sets, each with one of them at another value,

    tau_i exp(+- sqrt(n) sigma_i / tau_i),    weight 1 / (2 n)                      (1)

which is exact for polynomials of third order in ln tau. Source: I. Arasaratnam and
S. Haykin, Cubature Kalman filters, 2009, (22), (23).
"""

from __future__ import annotations

import numpy as np

from fieldcal.model import thresholds
from fieldcal.model.evidence.sets import Set
from fieldcal.model.posterior.model_average import average_over_sizes
from fieldcal.model.search.inference import InferenceResult


def sets_at_other_time_constants(found: InferenceResult) -> list[Set]:
    """The best set at the 2 n other values of its time constants, (1).

    Empty if it has no time constant, or none with a known sigma.
    """
    constants = [
        (i, name, min(group.shape_sigma / value, thresholds.MAX_SHAPE_LOG_SIGMA))
        for i, (_, group) in enumerate(found.best.members)
        for name, value in group.shape.items()
        if np.isfinite(group.shape_sigma)
    ]
    if not constants:
        return []
    moved = []
    fit = found.independent_fit()
    for i, name, sigma in constants:
        cause, group = found.best.members[i]
        steps = np.sqrt(len(constants)) * sigma * np.array([-1.0, 1.0])
        values = group.shape[name] * np.exp(steps)  # (1)
        cause, groups = fit.variants_near(cause, group, values.tolist())
        for variant in groups:
            members = list(found.best.members)
            members[i] = (cause, variant)
            moved.append(tuple(members))
    sets = fit.sets_with_columns_of(found.state, found.values, moved)
    sizes = found.best.sizes
    return [
        average_over_sizes(sets, sets.evaluate(variant, sizes)) for variant in moved
    ]
