"""Sizes of random effects, each with its uncertainty."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fieldcal.core.samples import Index
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.result import Quantity
from fieldcal.model import priors
from fieldcal.model.causes.cause import Group
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.size_between import (
    most_probable_axis_size,
    most_probable_size,
)
from fieldcal.model.posterior.probabilities import ProbableCause
from fieldcal.physics.effect import Param


def random_sizes(
    explanation: Explanation, standing: ProbableCause
) -> dict[str, Quantity]:
    """Sizes of a random effect, each with its uncertainty.

    They are those of the likeliest set: a covariance averaged over several sizes
    determines none of them.
    """
    best, out = explanation.posterior.best, dict[str, Quantity]()
    for member in standing.members:
        tried = float(priors.SIZES[best.sizes.members[best.members.index(member)]])
        out |= random_sizes_of_group(best, explanation.dictionary, member[1], tried)
    return out


def random_sizes_of_group(
    fitted: Set, d: Dictionary, group: Group, v: float
) -> dict[str, Quantity]:
    """Sizes of a random group, axis by axis, given that its size in a set is v.

    Their uncertainty follows from the information on ln v.
    """
    out = {}
    whole = most_probable_size(fitted.state, fitted.state.places_of(group.columns), v)
    for param, at in _scattered_columns(d, group):
        size, part = whole
        if len(at) < len(group.columns):
            size, part = most_probable_axis_size(
                fitted.state, fitted.state.places_of(at), v, whole
            )
        size *= param.typical
        out[param.name] = Quantity(size, size * part, param.unit)
    return out


def _scattered_columns(d: Dictionary, group: Group) -> Iterator[tuple[Param, Index]]:
    """Parameters of a random effect, with the columns that each one scatters."""
    params = group.effect.params if group.effect else ()
    if not group.params:
        yield from ((one, group.columns) for one in params)
    for c in group.params:
        cosines = d.cosine_columns(c, d.wander.modes[c])
        yield params[c], np.intersect1d(group.columns, cosines)
