"""The parameters of a set: the mean over all explanations, and which are determined.

The recording may show effects in addition to the requested parameters, with several
possible explanations. Each explanation gives an estimate. The calibration is their
mean, and its covariance includes their differences, (1) of `explanations`. Biases
that change are stated for the end of the recording, (1) of `end_values`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.calibration.lot_prior import LotPrior
from fieldcal.calibration.names import ParameterName, group_of
from fieldcal.core.samples import Array, Index
from fieldcal.model import thresholds
from fieldcal.model.causes.known_rows import KnownRows
from fieldcal.model.evidence.gram import Gram
from fieldcal.model.evidence.sets import Sets
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.posterior.mixture import Mixing, Mixture, covariance_of_means
from fieldcal.model.state import State
from fieldcal.solve.parameter_set import ParameterSet
from fieldcal.solve.variants import variants


def mixture_with_causes(
    parameter_set: ParameterSet,
    sets: Sets,
    carried: Sequence[Member],
    doubt: bool = True,
) -> Mixture:
    """Posterior of the requested parameters together with some causes, over all sizes.

    With `doubt`, each window may also be bad.
    """
    fitted = sets.evaluate(parameter_set.with_causes(carried))
    return Mixing(
        parameter_set, sets.gram, fitted, sets.typical_instability, doubt=doubt
    ).run()


@dataclass(frozen=True, slots=True)
class AllParameters:
    """All parameters of a set, determined or not.

    Attributes
    ----------
    values, covariance : (k,), (k, k), at the end of the recording
    shift_sigmas : (k,) by how many sigmas the unrequested effects move each

    """

    values: Array
    covariance: Array
    shift_sigmas: Array


def average_explanations(
    parameter_set: ParameterSet,
    gram: Gram,
    likeliest: Mixture,
    nominal: State,
    averaged: bool,
) -> AllParameters:
    """Mean and covariance over all explanations, (1) of `explanations`."""
    if not averaged or not any(
        explanation.members for explanation in parameter_set.explanations
    ):
        only = _parameters_at_end(parameter_set, likeliest, nominal)
        return AllParameters(*only, np.zeros(len(only[0])))
    sets = Sets(parameter_set, gram)
    doubt = bool(likeliest.bad.max(initial=0.0) > thresholds.LOOKED_AT)
    chance: dict[tuple[Member, ...], float] = {}
    for explanation in parameter_set.explanations:  # explanations may share variants
        for variant in variants(sets, parameter_set.base_members, explanation):
            p = explanation.probability * variant.probability
            chance[variant.members] = chance.get(variant.members, 0.0) + p
    estimates = []
    for members in chance:
        mixture = likeliest
        if parameter_set.with_causes(members) != parameter_set.members:
            mixture = mixture_with_causes(parameter_set, sets, members, doubt)
        estimates.append(_parameters_at_end(parameter_set, mixture, nominal))
    weight = np.array(list(chance.values()))
    means = np.array([value for value, _ in estimates])
    values: Array = weight @ means
    covariance = np.einsum("e,eij->ij", weight, np.array([c for _, c in estimates]))
    covariance += covariance_of_means(means, weight)
    plain, own = _parameters_at_end(
        parameter_set, mixture_with_causes(parameter_set, sets, (), doubt), nominal
    )
    return AllParameters(values, covariance, (values - plain) / np.sqrt(np.diag(own)))


def _parameters_at_end(
    parameter_set: ParameterSet, mixture: Mixture, nominal: State
) -> tuple[Array, Array]:
    """Parameters of an explanation at the end of the recording (`end_values`)."""
    picked = parameter_matrix(parameter_set, mixture.columns)
    before = _nominal_values(parameter_set, nominal)
    askew = _askew_variance(parameter_set, mixture)
    covariance = picked @ mixture.covariance @ picked.T + np.diag(askew)
    return before + picked @ mixture.mean, covariance


def _askew_variance(parameter_set: ParameterSet, mixture: Mixture) -> Array:
    """Variance of scale factors from what an axis sees across its own, (k,).

    The recording shows scale factors along the axes of the fixture, k, and couplings
    k_j that the calibration does not contain. Along its own axis an output has

        sqrt(k^2 + sum k_j^2)  =  k + sum k_j^2 / 2 k                              (2)

    which is more if the device is fastened askew. What is wanted is not known.
    """
    values = np.zeros(parameter_set.width)
    values[mixture.columns] = mixture.mean
    more = 0.5 * (parameter_set.end_values.coupling(values) ** 2).sum(axis=1)  # (2)
    names = [ParameterName.of(name) for name in parameter_set.names]
    return np.array([more[n.channel] ** 2 if n.is_scale else 0.0 for n in names])


def parameter_matrix(parameter_set: ParameterSet, columns: Index) -> Array:
    """Derivative of the parameters by some columns, (k, c)."""
    picked = np.zeros((len(parameter_set.names), len(columns)))
    for i, name in enumerate(parameter_set.names):
        own = parameter_set.column_by_name[name]
        picked[i, np.flatnonzero(columns == own)[0]] = 1.0
        parameter = ParameterName.of(name)
        if parameter.sensor:
            scale, c = parameter.is_scale, parameter.channel
            picked[i] += parameter_set.end_values.bias_scale[int(scale)][c, columns]
    return picked


def _nominal_values(parameter_set: ParameterSet, nominal: State) -> Array:
    """Nominal values of the parameters, (k,)."""
    before = np.zeros(len(parameter_set.names))
    for i, parameter in enumerate(map(ParameterName.of, parameter_set.names)):
        if parameter.sensor:
            every = nominal.scale if parameter.is_scale else nominal.bias
            before[i] = every[parameter.channel]
    return before


def lot_rows(
    parameter_set: ParameterSet, lot: LotPrior, nominal: State
) -> KnownRows | None:
    """Prior of a lot as rows for the columns of a set; None if it has no parameter."""
    lot = lot.subset(parameter_set.names)
    if not lot.names:
        return None
    picked = parameter_matrix(parameter_set, np.arange(parameter_set.width))
    before = _nominal_values(parameter_set, nominal)
    at = [parameter_set.names.index(name) for name in lot.names]
    return KnownRows.of(picked[at], lot.mean - before[at], lot.covariance)


def select_determined(
    parameter_set: ParameterSet, found: AllParameters
) -> tuple[tuple[str, ...], Array, Array, Array, tuple[str, ...]]:
    """Names, values, covariance and shifts of determined parameters; other names."""
    before = np.zeros(parameter_set.width)
    for group in parameter_set.groups:
        before[group.columns] = group.own_sigma()
    sigma = np.sqrt(np.diag(found.covariance))
    limits = thresholds.USEFUL | (
        {"gyr_scale": thresholds.USEFUL_TURNED} if parameter_set.options.turned else {}
    )
    known = [
        i
        for i, name in enumerate(parameter_set.names)
        if sigma[i] ** 2
        < thresholds.DETERMINED * before[parameter_set.column_by_name[name]] ** 2
        and sigma[i] < limits.get(group_of(name), np.inf)
    ]
    names = tuple(parameter_set.names[i] for i in known)
    missing = tuple(n for i, n in enumerate(parameter_set.names) if i not in known)
    square = found.covariance[np.ix_(known, known)]
    return names, found.values[known], square, found.shift_sigmas[known], missing
