"""The parameters of a set: the mean over all explanations, and which are determined.

The recording may show effects in addition to the requested parameters, with several
possible explanations. Each explanation gives an estimate. The calibration is their
mean, and its covariance includes their differences, (1) of `shown`. Biases that change
are stated for the end of the recording, (2) of `shown`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.calibration.lot_prior import LotPrior
from fieldcal.calibration.names import ParameterName, group_of
from fieldcal.core.samples import Array, Index
from fieldcal.model import thresholds
from fieldcal.model.causes.known import KnownRows
from fieldcal.model.evidence.gram import Gram
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.posterior.mixture import Mixing, Mixture, covariance_of_means
from fieldcal.model.search.selection import Search
from fieldcal.model.state import State
from fieldcal.solve.given import Given
from fieldcal.solve.variants import variants


def mixed(
    given: Given, search: Search, carried: Sequence[Member], doubt: bool = True
) -> Mixture:
    """A set with some causes beside what is asked for, at all its sizes.

    Each window may be bad as well, unless there is no `doubt`.
    """
    there = search.evaluated(given.beside(carried))
    return Mixing(given, search.gram, there, search.unstable, doubt=doubt).run()


@dataclass(frozen=True, slots=True)
class Parameters:
    """All parameters that a set has, determined or not.

    Attributes
    ----------
    values, covariance : (k,), (k, k), at the end of the recording
    moved : by how many sigmas what is carried moves each, (k,)

    """

    values: Array
    covariance: Array
    moved: Array


def averaged_over(
    given: Given, gram: Gram, likeliest: Mixture, nominal: State, averaged: bool
) -> Parameters:
    """The mean over all explanations, (1) of `shown`."""
    if not averaged or not any(one.members for one in given.explanations):
        only = _at_the_end(given, likeliest, nominal)
        return Parameters(*only, np.zeros(len(only[0])))
    search = Search(given, gram)
    doubt = bool(likeliest.bad.max(initial=0.0) > thresholds.LOOKED_AT)
    chance: dict[tuple[Member, ...], float] = {}
    for one in given.explanations:  # of which several may have a variant in common
        for same in variants(search, given.asked, one):
            p = one.probability * same.probability
            chance[same.members] = chance.get(same.members, 0.0) + p
    found = []
    for members in chance:
        there = likeliest
        if given.beside(members) != given.members:
            there = mixed(given, search, members, doubt)
        found.append(_at_the_end(given, there, nominal))
    weight = np.array(list(chance.values()))
    means = np.array([value for value, _ in found])
    values: Array = weight @ means
    covariance = np.einsum("e,eij->ij", weight, np.array([c for _, c in found]))
    covariance += covariance_of_means(means, weight)
    plain, own = _at_the_end(given, mixed(given, search, (), doubt), nominal)
    return Parameters(values, covariance, (values - plain) / np.sqrt(np.diag(own)))


def _at_the_end(given: Given, found: Mixture, nominal: State) -> tuple[Array, Array]:
    """Parameters of one explanation at the end of the recording, (2) of `shown`."""
    picked, before = picked_by(given, found.columns), _nominal_values(given, nominal)
    return before + picked @ found.mean, picked @ found.covariance @ picked.T


def picked_by(given: Given, columns: Index) -> Array:
    """Parameters by some columns, (k, c), beside their nominal values."""
    picked = np.zeros((len(given.names), len(columns)))
    for i, name in enumerate(given.names):
        picked[i, np.flatnonzero(columns == given.place(name)[0])[0]] = 1.0
        parameter = ParameterName.of(name)
        if parameter.sensor:
            scale, c = parameter.is_scale, parameter.channel
            picked[i] += given.ending[int(scale)][c, columns]
    return picked


def _nominal_values(given: Given, nominal: State) -> Array:
    """Nominal values of the parameters, (k,)."""
    before = np.zeros(len(given.names))
    for i, parameter in enumerate(map(ParameterName.of, given.names)):
        if parameter.sensor:
            every = nominal.scale if parameter.is_scale else nominal.bias
            before[i] = every[parameter.channel]
    return before


def known_rows(given: Given, lot: LotPrior, nominal: State) -> KnownRows | None:
    """What a lot says of the columns of a set; None where it says nothing of them."""
    lot = lot.only(given.names)
    if not lot.names:
        return None
    picked, before = (
        picked_by(given, np.arange(given.width)), _nominal_values(given, nominal)
    )  # fmt: skip
    at = [given.names.index(name) for name in lot.names]
    return KnownRows.of(picked[at], lot.mean - before[at], lot.covariance)


def determined(
    given: Given, found: Parameters
) -> tuple[tuple[str, ...], Array, Array, Array, tuple[str, ...]]:
    """Parameters that are determined, and the names of those that are not."""
    before = np.zeros(given.width)
    for group in given.groups:
        before[group.columns] = group.sizes(group.fixed or 1.0)
    sigma = np.sqrt(np.diag(found.covariance))
    limits = thresholds.USEFUL | (
        {"gyr_scale": thresholds.USEFUL_TURNED} if given.wanted.turned else {}
    )
    known = [
        i
        for i, name in enumerate(given.names)
        if sigma[i] ** 2 < thresholds.DETERMINED * before[given.place(name)[0]] ** 2
        and sigma[i] < limits.get(group_of(name), np.inf)
    ]
    names = tuple(given.names[i] for i in known)
    missing = tuple(n for i, n in enumerate(given.names) if i not in known)
    square = found.covariance[np.ix_(known, known)]
    return names, found.values[known], square, found.moved[known], missing
