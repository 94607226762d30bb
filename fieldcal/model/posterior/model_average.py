"""Estimates averaged over the sets that the search visited.

The best set is not certain: an effect may have all of its parameters or only some, or
an alias may be present instead. With the estimate of each set s and its weight w_s,

    mean = sum_s w_s mean_s
    cov = sum_s w_s [cov_s + (mean_s - mean) (mean_s - mean)^T]                     (1)

A parameter that a set does not have is 0 in it. Every device has some effects to a
small degree. Such an effect x is eliminated with the sets that do not contain it. With
its prior covariance Q, G_sx the elements of G between the columns of set and effect,
and M and b' of `gram` after the elimination of the set,

    P = (Q^-1 + M)^-1
    mean_s - C_s G_sx P b'  and  C_s + C_s G_sx P G_xs C_s                          (2)

replace mean_s and C_s. Sources: J. Hoeting and others, Bayesian model averaging: a
tutorial, 1999, (1) to (3); for (2), the inverse of a partitioned matrix.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property, partial

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model import thresholds
from fieldcal.model.causes.cause import Group
from fieldcal.model.evidence.cholesky import cholesky_root, triangular_inverse
from fieldcal.model.evidence.eliminated import Eliminated
from fieldcal.model.evidence.sets import Set, Sets
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.evidence.unfitted_groups import groups_not_in
from fieldcal.model.posterior.common_axes import group_in, parameter_rows, pick_columns
from fieldcal.model.posterior.mixture import Mixing, covariance_of_means
from fieldcal.model.posterior.probabilities import Posterior
from fieldcal.model.search.set_at_instability import with_typical_calibration


def average_over_sizes(sets: Sets, fitted: Set) -> Set:
    """A set as it is reported: with mean and covariance of the mixture in its state.

    The most probable size may underestimate the uncertainty. If the rows hardly
    determine a calibration parameter, its most probable size is the smallest of the
    grid, and the most probable instability in few windows is often zero. Therefore
    calibration parameters have the prior of devices of their grade, and the estimate is
    the mean over all instabilities (`mixture`).
    """
    prior_sigma, _ = with_typical_calibration(sets.dictionary, fitted)
    columns = fitted.state.columns
    state = Eliminated.of(fitted.state.rows, columns, prior_sigma)
    widened = replace(fitted, state=state)
    if len(np.unique(columns)) < len(columns) or not len(columns):
        return widened  # a column of two groups has one estimate for each
    mixture = Mixing(
        sets.dictionary, sets.gram, widened, sets.typical_instability, False
    ).run()
    half = np.linalg.cholesky(mixture.covariance).T
    state = replace(state, half=half, estimate=mixture.mean)
    return replace(fitted, state=state)


Pick = Callable[[Set], Array]
"""Rows (k, a) that give k quantities from the a columns of a set; a quantity that the
set does not have is a row of zeros."""

Estimate = tuple[Array, Array]
"""Mean (a,) of a set's columns, and a root R of their covariance R R^T, (a, m)."""


class ModelAverage:
    """Averages over the sets of a posterior.

    The sets `best` replace the best one, with equal weights: its estimate averaged over
    sizes, and at other time constants.
    """

    def __init__(self, posterior: Posterior, best: Sequence[Set]) -> None:
        self.posterior, self.best = posterior, best
        self._known: dict[Set, Estimate] = {}

    @cached_property
    def sets(self) -> list[tuple[Set, float]]:
        """Sets with enough weight, averaged over sizes, and their weights."""
        visited, out = self.posterior.weights_on_grid, list[tuple[Set, float]]()
        least = np.exp(-thresholds.AVERAGED_LOG_DISTANCE) * max(w for _, w in visited)
        for fitted, weight in visited:
            if weight > least:
                averaged = self._with_mixed_sizes(fitted)
                out += [(s, weight / len(averaged)) for s in averaged]
        return out

    def _with_mixed_sizes(self, fitted: Set) -> Sequence[Set]:
        """The set with its estimate averaged over sizes; several for the best set."""
        if fitted is self.posterior.best:
            return self.best
        return [average_over_sizes(self.posterior.sets, fitted)]

    def average_of_member(self, member: Member) -> tuple[Array, Array]:
        """Mean (k,) and covariance (k, k) of a member's parameters, if it is present.

        If orientations are not known, a rotation of the device axes turns one
        parameter into another, such as k13 into k31. Sets with other parameters of the
        cause are then omitted; parameters that only change with the axes are stated in
        the common ones.
        """
        cause, group = member
        containing = [(s, w) for s, w in self.sets if cause.key in s.keys]
        unoriented = self.posterior.sets.dictionary.unoriented
        free = bool(unoriented.all())
        if unoriented.any() and not (free and group.effect and group.effect.turned_by):
            mine = set(group.params)
            containing = [
                (s, w) for s, w in containing if set(group_in(s, member).params) <= mine
            ]

        if not containing:  # the member is too unlikely to count
            containing = [(s, 1.0) for s in self.best]

        pick = partial(parameter_rows, member=member, turned=free)
        return average_over_sets(containing, pick, self._estimate)

    def average_of_columns(self, columns: Index) -> tuple[Array, Array]:
        """Mean (k,) and covariance (k, k) of columns."""
        pick = partial(pick_columns, columns=columns)
        return average_over_sets(self.sets, pick, self._estimate)

    def _estimate(self, fitted: Set) -> Estimate:
        """Estimate of a set, with the uncertainty of `unfitted` effects; cached."""
        if fitted not in self._known:
            left = self.posterior.sets.dictionary.unfitted
            self._known[fitted] = set_estimate(fitted, left)
        return self._known[fitted]


def average_of_columns(
    sets: Sequence[tuple[Set, float]], columns: Index, unfitted: Sequence[Group] = ()
) -> tuple[Array, Array]:
    """Mean (k,) and covariance (k, k) of columns over weighted sets."""
    pick = partial(pick_columns, columns=columns)
    return average_over_sets(sets, pick, partial(set_estimate, unfitted=unfitted))


def average_over_sets(
    sets: Sequence[tuple[Set, float]],
    pick: Pick,
    estimate: Callable[[Set], Estimate] | None = None,
) -> tuple[Array, Array]:
    """Mean (k,) and covariance (k, k) of quantities over weighted sets, (1).

    `estimate` gives the estimate of each set; that of its state if None.
    """
    means, covs = [], []
    for fitted, _ in sets:
        rows = pick(fitted)
        mean, root = (estimate or set_estimate)(fitted)
        picked = rows @ root
        means.append(rows @ mean)
        covs.append(picked @ picked.T)
    weight = np.array([w for _, w in sets])
    weight /= weight.sum()
    mean = weight @ np.array(means)
    cov = np.einsum("s,sij->ij", weight, np.array(covs))
    return mean, cov + covariance_of_means(np.array(means), weight)  # (1)


def set_estimate(fitted: Set, unfitted: Sequence[Group] = ()) -> Estimate:
    """Estimate of a set's columns, with the groups of `unfitted` eliminated, (2)."""
    missing, posterior = groups_not_in(fitted, unfitted), fitted.state
    if not missing:
        return posterior.estimate, posterior.half.T
    columns = np.concatenate([group.columns for group in missing])
    typical = np.concatenate([group.typical for group in missing])
    state = Eliminated.of(posterior.rows, posterior.columns, posterior.prior_sigma)
    inner, rhs = state.schur_complement(columns, typical)
    inner.flat[:: len(columns) + 1] += 1.0
    half = triangular_inverse(cholesky_root(inner))
    shared = state.rows.matrix(state.columns, columns) * typical
    moved = state.inverse @ shared @ half.T
    return posterior.estimate - moved @ (half @ rhs), np.hstack(
        [posterior.half.T, moved]
    )  # (2)
