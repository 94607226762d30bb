"""Dense reference: every row with its covariance written out, and textbook algebra.

    y ~ N(0, C),    C = R + Phi diag(s^2) Phi^T

Nothing of the model's engine is used here, and nothing is made fast.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array

Index = NDArray[np.intp]


@dataclass(frozen=True)
class Dense:
    """Rows y with their design and their covariance.

    Attributes
    ----------
    y : (n,)
    design : (n, k)
    cov : (n, n) R
    white : (n,) standard deviation of the white noise in R

    """

    y: Array
    design: Array
    cov: Array
    white: Array

    def total(self, columns: Index, sizes: Array) -> Array:
        """Covariance of the rows with some columns of some sizes, (n, n)."""
        wide = self.design[:, columns] * sizes
        out: Array = self.cov + wide @ wide.T
        return out

    def evidence(self, columns: Index, sizes: Array) -> float:
        """Density of the rows, ln, less that constant of white noise."""
        total = self.total(columns, sizes)
        sign, log_det = np.linalg.slogdet(total)
        assert sign > 0
        square = float(self.y @ np.linalg.solve(total, self.y))
        return -0.5 * (square + float(log_det)) + float(np.log(self.white).sum())

    def posterior(self, columns: Index, sizes: Array) -> tuple[Array, Array]:
        """Mean and covariance of the columns' values, by generalised least squares."""
        gain = np.linalg.solve(self.total(columns, sizes), self.design[:, columns])
        gain = gain * sizes**2
        mean: Array = gain.T @ self.y
        seen = self.design[:, columns] * sizes**2
        cov: Array = np.diag(sizes**2) - gain.T @ seen
        return mean, cov

    def information(self) -> tuple[Array, Array]:
        """Phi^T R^-1 Phi and Phi^T R^-1 y of all columns."""
        whole = np.linalg.solve(self.cov, np.column_stack([self.design, self.y]))
        return self.design.T @ whole[:, :-1], self.design.T @ whole[:, -1]


def shared(window: Index, channel: Index, size: Array) -> Array:
    """Covariance of what the rows of a channel in a window share, (n, n).

    `size` (n,) is its standard deviation in each row.
    """
    alike = np.equal.outer(window, window) & np.equal.outer(channel, channel)
    return np.where(alike, np.multiply.outer(size, size), 0.0)
