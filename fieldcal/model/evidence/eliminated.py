"""The evidence of a set of columns, and what one more group adds to it.

With G = Phi^T R^-1 Phi and b = Phi^T R^-1 (y - h) of all rows, weighted at an
instability (`gram`), and S the prior standard deviations v T of a set's columns,

    ln Z = b^T S (I + S G S)^-1 S b / 2 - ln |I + S G S| / 2 - ln |R| / 2           (1)

and for one more group k, after the set is eliminated, with M = U diag(lambda) U^T the
Schur complement of T G T and q = U^T T b',

    gain(v) = sum_j [ v^2 q_j^2 / (1 + v^2 lambda_j) - ln(1 + v^2 lambda_j) ] / 2   (2)

The only approximation is the grid of v. Source: M. Tipping and A. Faul, Fast marginal
likelihood maximisation for sparse Bayesian models, 2003.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model import tolerances
from fieldcal.model.evidence.cholesky import cholesky_root, triangular_inverse
from fieldcal.model.evidence.gram import WeightedGram
from fieldcal.model.evidence.tridiagonal import is_wide, tridiagonal_gains
from fieldcal.model.priors import SIZES


@dataclass(frozen=True)
class Eliminated:
    """A set of columns with their prior sizes, eliminated: its posterior.

    Attributes
    ----------
    rows : weighted Gram matrix
    columns : (a,) of the dictionary; a column may occur twice
    prior_sigma : (a,) prior standard deviation of each
    half : (a, a) root H of the posterior covariance H^T H
    estimate : (a,) posterior mean
    score : ln Z, (1)

    """

    rows: WeightedGram
    columns: Index
    prior_sigma: Array
    half: Array
    estimate: Array
    score: float

    @classmethod
    def of(cls, rows: WeightedGram, columns: Index, sizes: Array) -> Eliminated:
        """Eliminate columns with prior standard deviations `sizes`."""
        scaled, rhs = rows.normal_equations(columns)
        scaled *= sizes
        scaled *= sizes[:, None]
        scaled.flat[:: len(columns) + 1] += 1.0
        root = cholesky_root(scaled)
        half = triangular_inverse(root) * sizes
        projected = half @ rhs
        score = 0.5 * (float(projected @ projected) - rows.square - rows.log_det)
        score -= float(np.log(np.diag(root)).sum())  # (1)
        return cls(rows, columns, sizes, half, half.T @ projected, score)

    def places_of(self, columns: Index) -> Index:
        """Indices of columns in the set; of one that occurs twice, the last.

        The columns of a member come after those of the groups that are always in.
        """
        places = [int(np.flatnonzero(self.columns == c)[-1]) for c in columns]
        return np.array(places, dtype=np.intp)

    def without(self, columns: Index | list[int]) -> Eliminated:
        """The set without some columns, the others with the same prior sizes."""
        kept = ~np.isin(self.columns, columns)
        return Eliminated.of(self.rows, self.columns[kept], self.prior_sigma[kept])

    @cached_property
    def inverse(self) -> Array:
        """Posterior covariance S (I + S G S)^-1 S, (a, a)."""
        return self.half.T @ self.half

    def schur_complement(self, columns: Index, typical: Array) -> tuple[Array, Array]:
        """M and T b' of further columns after elimination, in typical sizes."""
        shared = self.rows.matrix(self.columns, columns)
        inner, rhs = self.rows.normal_equations(columns)
        taken = self.half @ shared
        inner -= taken.T @ taken
        rhs -= shared.T @ self.estimate
        return inner * typical * typical[:, None], rhs * typical

    def schur_complement_of_means(self, kind: int) -> tuple[Array, Array]:
        """The same for an offset of each mean of one kind of instability.

        `kind` is its index 0 to 6; the offsets are in outputs.
        """
        *at, size = self.rows.offsets(kind)
        where = tuple(at)
        shared = self._mean_products[where] * size[:, None]
        taken = shared @ self.half.T
        inner = -(taken @ taken.T)
        inner.flat[:: len(size) + 1] += self.rows.mean_information[where] * size**2
        return inner, self.rows.mean_rhs[where] * size - shared @ self.estimate

    @cached_property
    def _mean_products(self) -> Array:
        """R^-1 Phi of the means of windows by the set's columns, (p, 6, a)."""
        return self.rows.mean_products(self.columns)

    def gain_by_size(self, columns: Index, typical: Array) -> Array:
        """Gain of ln Z by a further group, at each of its sizes, (2)."""
        own = np.diag(self.rows.matrix(columns, columns)) * typical**2
        return evidence_gains(
            *self.schur_complement(columns, typical), float(own.max())
        )


def evidence_gains(inner: Array, rhs: Array, own: Array | float) -> Array:
    """Gain (2) at each of `SIZES` for groups of equal width: (..., k, k), (..., k).

    `own` (...) is the largest diagonal element of T G T before the elimination.
    """
    if is_wide(rhs):
        return tridiagonal_gains(inner, rhs)
    return gains_from_eigenvalues(*group_directions(inner, rhs, own))


def noticeable_gains(
    inner: Array, rhs: Array, own: Array, least: Array
) -> tuple[Index, Index, Array]:
    """Gains (2) of those groups (n, m, k, k), (n, m, k) that reach `least` (m,).

    Indices of the groups, (g,) and (g,), and their gains (g, sizes). `own` (n, m) are
    the largest diagonal elements of T G T before the elimination. The largest gain of a
    group may still be a little below its least one.
    """
    if is_wide(rhs):
        every = tridiagonal_gains(inner, rhs)
        n, m = np.nonzero(every.max(axis=-1) >= least)
        return n, m, every[n, m]
    strength, power = group_directions(inner, rhs, own)
    n, m = np.nonzero(largest_gains(strength, power) >= least)
    return n, m, gains_from_eigenvalues(strength[n, m], power[n, m])


def group_directions(
    inner: Array, rhs: Array, own: Array | float
) -> tuple[Array, Array]:
    """Eigenvalues lambda and q^2 of (2) of groups of equal width, (..., k) each.

    The parameters are those of `evidence_gains`. Both are 0 in a direction that the
    rows do not determine.
    """
    if rhs.shape[-1] == 1:
        strength, power = inner[..., 0], rhs**2
    else:
        strength, axes = np.linalg.eigh(inner)
        power = (np.swapaxes(axes, -1, -2) @ rhs[..., None])[..., 0] ** 2
    determined = strength > tolerances.SINGULAR * np.maximum(
        np.asarray(own)[..., None], 1e-300
    )
    strength = np.where(determined, strength, 0.0)
    power = np.where(determined, power, 0.0)
    return strength, power


def largest_gains(strength: Array, power: Array) -> Array:
    """Upper bound of the gain (2) at any size, (...), of lambda and q^2, (..., k).

    That of each direction at a size of its own, v^2 lambda = q^2 / lambda - 1.

    >>> strength, power = np.array([4.0, 3.0]), np.array([36.0, 24.0])
    >>> gains = gains_from_eigenvalues(strength, power)
    >>> bool(gains.max() <= largest_gains(strength, power) < gains.max() + 0.1)
    True
    """
    ratio = np.divide(power, strength, out=np.ones(power.shape), where=strength > 0)
    ratio = np.maximum(ratio, 1.0)
    most: Array = 0.5 * (ratio - 1 - np.log(ratio)).sum(axis=-1)
    return most


def gains_from_eigenvalues(
    strength: Array, power: Array, sizes: Array = SIZES
) -> Array:
    """Gain (2) at some sizes, from lambda and q^2, (..., k) each."""
    square = sizes**2
    # sizes are the last axis: numpy is slow at sums over a last axis of few elements
    ratio = strength[..., None] * square
    ratio += 1
    gain = power[..., None] * square
    gain /= ratio
    gain -= np.log(ratio, out=ratio)
    total: Array = 0.5 * gain.sum(axis=-2)
    return total
