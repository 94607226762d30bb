"""A set at other values of its time constants, in which the rows are not linear.

A time constant is uncertain by a sigma of its own, and what fades with it, and the
biases beside that, are then otherwise. A set with n of them stands for 2 n sets, in
each of which one of them is elsewhere,

    tau_i exp(+- sqrt(n) sigma_i / tau_i),    weight 1 / (2 n)                      (1)

which is exact for what goes with ln tau evenly. Source: I. Arasaratnam and S. Haykin,
Cubature Kalman filters, 2009, (22), (23).
"""

from __future__ import annotations

import numpy as np

from fieldcal.model.evidence.sets import Set
from fieldcal.model.posterior.reported import reported
from fieldcal.model.search.inference import Inferred

MOST = 1.0
"""Largest sigma of a time constant's logarithm: one that is less certain is open."""


def elsewhere(found: Inferred) -> list[Set]:
    """The best set with each of its time constants elsewhere, as numbers are taken.

    Empty where it has none, or none that is uncertain.
    """
    some = [
        (i, name, min(group.unsure / value, MOST))
        for i, (_, group) in enumerate(found.best.members)
        for name, value in group.shape.items()
        if np.isfinite(group.unsure)
    ]
    if not some:
        return []
    moved = []
    inference = found.inference.copied(found)
    for i, name, sigma in some:
        cause, group = found.best.members[i]
        steps = np.sqrt(len(some)) * sigma * np.array([-1.0, 1.0])
        values = group.shape[name] * np.exp(steps)  # (1)
        cause, groups = inference.near(cause, group, values.tolist())
        for one in groups:
            members = list(found.best.members)
            members[i] = (cause, one)
            moved.append(tuple(members))
    search = inference.search_among(found.state, found.values, moved)
    sizes = found.best.sizes
    return [reported(search, search.evaluated(one, sizes)) for one in moved]
