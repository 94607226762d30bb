"""Parameters of a cause in one of two recordings that are compared."""

from __future__ import annotations

import numpy as np

from fieldcal.against.widened import WidenedSet
from fieldcal.core.samples import Array
from fieldcal.diagnosis.findings import found_effects, random_sizes
from fieldcal.diagnosis.result import Quantity
from fieldcal.model import priors, thresholds
from fieldcal.model.causes.cause import Group
from fieldcal.model.evidence.sizing import Member
from fieldcal.physics.effect import Motion, Scatter, Sensor


def cause_quantities(there: WidenedSet, member: Member) -> dict[str, Quantity]:
    """Parameters of a cause that the rows determine."""
    group = member[1]
    if group.effect is None:
        return {}
    if isinstance(group.effect, Scatter):
        d = there.fit.dictionary
        return random_sizes.random_sizes_of_group(
            there.set, d, group, size_of_cause(there, member)
        )
    values, covariance = there.estimate(group.columns)
    before = group.prior_sigma(size_of_cause(there, member))
    out = _determined_parameters(there, group, values, covariance, before)
    for shape in group.effect.shapes:
        at = group.shape[shape.name]
        sigma = group.shape_sigma(shape.name)
        unsure = sigma if np.isfinite(sigma) else None
        out[shape.name] = Quantity(float(at), unsure, shape.unit)
    return out


def quantities_at_size(
    there: WidenedSet, member: Member, size: float
) -> dict[str, Quantity]:
    """Parameters of a cause with an equation, given `size` in units of typical."""
    group, told = member[1], there.effect_information(member[0].key)
    if told is None or not isinstance(group.effect, Motion | Sensor):
        return {}
    before = size * group.typical
    known = np.linalg.inv(told.inner + np.eye(len(told.rhs)) / size**2)
    covariance = known * np.outer(group.typical, group.typical)
    values = group.typical * (known @ told.rhs)
    return _determined_parameters(there, group, values, covariance, before)


def size_of_cause(there: WidenedSet, member: Member) -> float:
    """Size of a member of the set, in units of its typical size."""
    at = there.set.members.index(member)
    return float(priors.SIZES[there.set.sizes.members[at]])


def _determined_parameters(
    there: WidenedSet, group: Group, values: Array, covariance: Array, before: Array
) -> dict[str, Quantity]:
    """Parameters (k,) of an effect that the rows determine.

    That is: their variance is clearly less than that of the prior, `before` (k,).
    """
    effect, sigma = group.effect, np.sqrt(np.diag(covariance))
    if effect is None:
        return {}
    params = [effect.params[j] for j in group.params]
    out = {
        p.name: Quantity(float(v), float(s), p.unit)
        for p, v, s, b in zip(params, values, sigma, before, strict=True)
        if s**2 < thresholds.DETERMINED * b**2
    }
    if there.fit.dictionary.unoriented.all():
        out = found_effects.merge_turned_parameters(
            group, values, covariance, before, out
        )
    return out
