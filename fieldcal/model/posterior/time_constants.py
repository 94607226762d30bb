"""The uncertainty of time constants, in which the rows are not linear.

The shape parameters of a set's effects, time constants and the onset of a change, have
the covariance C in their natural coordinates x (`Shape.moved`), ln tau of a time
constant tau. The amplitudes of the effects, and the biases, depend on them nonlinearly.
A set with n of them is replaced by 2 n sets at

    x +- sqrt(n) L_i,    L L^T = C,    weight 1 / (2 n)                             (1)

with the columns L_i of L, which is exact for polynomials of third order in x. Source:
I. Arasaratnam and S. Haykin, Cubature Kalman filters, 2009, (22), (23).
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model import thresholds
from fieldcal.model.causes.cause import Group
from fieldcal.model.evidence.sets import Set
from fieldcal.model.posterior.model_average import average_over_sizes
from fieldcal.model.search.inference import InferenceResult


def sets_at_other_time_constants(found: InferenceResult) -> list[Set]:
    """The best set at the 2 n other values of its time constants, (1).

    Empty if it has no time constant, or none of known uncertainty.
    """
    steps = [_independent_steps(group) for _, group in found.best.members]
    n = sum(map(len, steps))
    if not n:
        return []
    moved = []
    fit = found.independent_fit()
    for i, (cause, group) in enumerate(found.best.members):
        far = [sign * np.sqrt(n) * one for one in steps[i] for sign in (-1.0, 1.0)]
        shapes = [group.moved_shape(step) for step in far]  # (1)
        cause, groups = fit.variants_near(cause, group, shapes)
        for variant in groups:
            members = list(found.best.members)
            members[i] = (cause, variant)
            moved.append(tuple(members))
    sets = fit.sets_with_columns_of(found.state, found.values, moved)
    sizes = found.best.sizes
    return [
        average_over_sizes(sets, sets.evaluate(variant, sizes)) for variant in moved
    ]


def _independent_steps(group: Group) -> list[Array]:
    """Columns L_i (m,) of the square root of the covariance of its shape.

    They are shortened to steps that the prior of a time constant allows.
    """
    if group.effect is None or group.shape_covariance is None:
        return []
    logs = [not s.is_instant for s in group.effect.shapes]
    columns = np.linalg.cholesky(group.shape_covariance).T
    longest = np.abs(columns[:, logs]).max(axis=1, initial=0.0)
    part = np.minimum(thresholds.MAX_SHAPE_LOG_SIGMA / np.maximum(longest, 1e-9), 1.0)
    return list(columns * part[:, None])
