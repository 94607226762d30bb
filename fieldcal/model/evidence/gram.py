"""The Gram matrix of all columns, and its weights at an instability.

The rows of a window share errors: an instability, rounding, rotations of an unknown
orientation. Each window is therefore split into the deviations from its mean, which
these errors do not affect, and the mean, with the covariance

    C_p = S_p^-1 + diag(tau^2) + A_p A_p^T                                         (1)

with S_p the information on the mean, tau the instability of each channel and A_p the
derivative by free rotations.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fieldcal.core.samples import Array, Index, Mask
from fieldcal.model.evidence.block_sum import BlockSum


@dataclass(frozen=True, slots=True)
class Gram:
    """Normal equations of all columns, with the means of windows kept separate.

    Attributes
    ----------
    within : (k, k) Phi^T R^-1 Phi of the courses of windows about their means, and of
        turns, channel by channel
    rhs : (k,) right-hand side of the same, Phi^T R^-1 (y - h)
    square : (y - h)^T R^-1 (y - h) of the same
    means : (p, 6, k) columns' means in each window
    residual : (p, 6) mean of y - h
    info : (p, 6) information on each mean by white noise, 1 / variance; 0 where nothing
        was measured
    shared : (p, 6) standard deviation of known errors that all rows of a window share
    free_rotations : (p, 6, 2) A_p, derivative of the means by free rotations
    kind : (p, 6) index 0 to 6 of the instability of each mean; closures of turns have
        an instability of their own (`CLOSURE`)
    closure_errors : (p, 6, 6) error of a closure for an instability of one, by channel
    index : (all,) place of each column of the dictionary here, -1 if absent

    """

    within: BlockSum
    rhs: Array
    square: float
    means: Array
    residual: Array
    info: Array
    shared: Array
    free_rotations: Array
    kind: Index
    closure_errors: Array
    index: Index

    def select_columns(self, columns: Index) -> Gram:
        """The Gram matrix of some columns of the dictionary."""
        kept = np.unique(columns)
        at = self.index[kept]
        index = np.full(len(self.index), -1, dtype=np.intp)
        index[kept] = np.arange(len(kept))
        return replace(
            self, within=self.within.select(at), rhs=self.rhs[at],
            means=self.means[:, :, at], index=index,
        )  # fmt: skip

    def select_windows(self, windows: Mask, info: Array) -> Gram:
        """Some windows, with other information on their means."""
        parts = ("means", "residual", "shared", "free_rotations", "kind",
                 "closure_errors")  # fmt: skip
        kept = {name: getattr(self, name)[windows] for name in parts}
        return replace(self, info=info[windows], **kept)

    def with_known(self, columns: Index, values: Array) -> Gram:
        """The rows less what columns (c,) of the dictionary of known values add."""
        at = self.index[columns]
        taken = self.within.part(np.arange(len(self.rhs)), at) @ values
        square = self.square - float(values @ (2 * self.rhs[at] - taken[at]))
        return replace(
            self, rhs=self.rhs - taken, square=square,
            residual=self.residual - self.means[:, :, at] @ values,
        )  # fmt: skip

    def with_instability(self, tau: Array) -> WeightedGram:
        """Weight the means with instabilities by kind, (7,)."""
        if self.free_rotations.any():
            root, log_det = self.whitening(tau)
            return WeightedGram(self, np.zeros(0), root, float(log_det))
        variance = self.relative_variance(tau)
        log_det = np.log(variance).sum()
        return WeightedGram(self, self.info / variance, np.zeros(0), float(log_det))

    def relative_variance(self, tau: Array) -> Array:
        """Variance of the means over that by white noise, by channel, (..., p, 6).

        `tau` (..., 7) are the instabilities.
        """
        out: Array = 1 + self.info * self._shared_variance(tau)
        return out

    def _shared_variance(self, tau: Array) -> Array:
        """Variance of the means in addition to white noise, by channel, (..., p, 6)."""
        square = tau**2
        closures = np.einsum("pij,...j->...pi", self.closure_errors**2, square[..., :6])
        out: Array = self.shared**2 + square[..., self.kind] + closures
        return out

    def whitened(self, tau: Array, table: Array) -> tuple[Array, Array]:
        """Whitened means (..., r, c) of a table (p, 6, c), for measured channels.

        At instabilities (..., 7); with ln |R| (...) beyond that of white noise.
        """
        known = self.info > 0
        if self.free_rotations.any():
            root, log_det = self.whitening(tau)
            whole: Array = (root @ table)[..., known, :]
            return whole, log_det
        variance = self.relative_variance(tau)
        weight = np.sqrt(self.info / variance)[..., known]
        return weight[..., None] * table[known], np.log(variance).sum(axis=(-2, -1))

    def whitening(self, tau: Array) -> tuple[Array, Array]:
        """Whitening W of the means at instabilities, (..., p, 6, 6), and ln |R|.

        `tau` is (..., 7). Free rotations of a window correlate its channels.
        """
        # root of (1) as a product, by the singular values of what rotations add: means
        # of repeated or smoothed samples are known 1e10 times better than rotations
        alone = self.relative_variance(tau)
        weight = np.sqrt(self.info / alone)
        along, size, _ = np.linalg.svd(
            weight[..., None] * self.free_rotations, full_matrices=False
        )
        less = 1 - 1 / np.hypot(1.0, size)
        root = np.eye(6) - (along * less[..., None, :]) @ np.swapaxes(along, -1, -2)
        log_det = np.log(alone).sum(axis=(-2, -1))
        log_det += 2 * np.log(np.hypot(1.0, size)).sum(axis=(-2, -1))
        return root * weight[..., None, :], log_det


@dataclass(frozen=True)
class WeightedGram:
    """A Gram matrix at some instabilities.

    Attributes
    ----------
    gram : the matrix without instability
    weight : (p, 6) information on each mean; empty if they are correlated
    root : (p, 6, 6) whitening of the means; empty if they are uncorrelated
    log_det : ln |R| beyond that of white noise

    """

    gram: Gram
    weight: Array
    root: Array
    log_det: float

    def whiten(self, means: Array, windows: Index | slice = slice(None)) -> Array:
        """Means (w, 6, c) of some windows whitened; 0 of channels not measured."""
        if self.root.size:
            whole: Array = self.root[windows] @ means
            return whole
        return means * np.sqrt(self.weight[windows])[..., None]

    def whitened(self, at: Index) -> Array:
        """Whitened means of columns `at` (c,) of this matrix, (r, c)."""
        return self.whiten(self.gram.means[:, :, at])[self.gram.info > 0]

    @cached_property
    def residual(self) -> Array:
        """Whitened means of y - h, (p, 6)."""
        return self.whiten(self.gram.residual[:, :, None])[..., 0]

    def among(self, gram: Gram) -> WeightedGram:
        """The same weights for other columns of the same rows."""
        return replace(self, gram=gram)

    def matrix(self, one: Index, other: Index) -> Array:
        """Phi^T R^-1 Phi between columns `one` and `other`."""
        if one is other:
            return self.normal_equations(one)[0]
        rows, columns = self.gram.index[one], self.gram.index[other]
        out = self.gram.within.part(rows, columns)
        out += self.whitened(rows).T @ self.whitened(columns)
        return out

    def rhs(self, columns: Index) -> Array:
        """Phi^T R^-1 (y - h) of some columns."""
        return self.normal_equations(columns)[1]

    def normal_equations(self, columns: Index) -> tuple[Array, Array]:
        """Phi^T R^-1 Phi and Phi^T R^-1 (y - h) of some columns."""
        at, known = self.gram.index[columns], self.gram.info > 0
        white, matrix = self.whitened(at), self.gram.within.part(at, at)
        matrix += white.T @ white
        return matrix, self.gram.rhs[at] + white.T @ self.residual[known]

    @property
    def square(self) -> float:
        """(y - h)^T R^-1 (y - h)."""
        return self.gram.square + float((self.residual**2).sum())

    def offsets(self, kind: int) -> tuple[Index, Index, Array]:
        """Means that an instability of a kind moves, and by how much for one of 1.

        (m,) windows or turns, channels, and sizes. Rotations correlate only means of
        different kinds.
        """
        gram = self.gram
        size = (gram.kind == kind).astype(float)
        if kind < 6:
            size += gram.closure_errors[:, :, kind]
        rows, slots = np.nonzero((size > 0) & (gram.info > 0))
        return rows, slots, size[rows, slots]

    @cached_property
    def mean_information(self) -> Array:
        """Diagonal of R^-1 of the means, (p, 6)."""
        if self.root.size:
            out: Array = (self.root**2).sum(axis=1)
            return out
        return self.weight

    @cached_property
    def mean_rhs(self) -> Array:
        """R^-1 (y - h) of the means, (p, 6)."""
        return self._of_means(self.gram.residual[..., None])[..., 0]

    def mean_products(self, columns: Index) -> Array:
        """R^-1 Phi of the means by some columns, (p, 6, k)."""
        return self._of_means(self.gram.means[:, :, self.gram.index[columns]])

    def _of_means(self, table: Array) -> Array:
        """R^-1 times a table of the means, (p, 6, k)."""
        if self.root.size:
            out: Array = np.swapaxes(self.root, 1, 2) @ (self.root @ table)
            return out
        return self.weight[..., None] * table
