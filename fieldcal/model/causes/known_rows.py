"""Prior knowledge of columns, as rows in addition to those of the recording.

    residual = design u + e,    e ~ N(0, 1)                                         (1)

with u the parameters of some columns. These rows are used like all other rows in the
estimate and in the evidence of every set.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array, Index


@dataclass(frozen=True, slots=True, eq=False)
class KnownRows:
    """Rows (1), divided by their standard deviations.

    Attributes
    ----------
    columns : (k,) indices of columns in the dictionary
    design : (r, k) derivatives of the rows by these columns
    residual : (r,) values less those of the base state

    """

    columns: Index
    design: Array
    residual: Array

    @classmethod
    def of(cls, design: Array, residual: Array, covariance: Array) -> KnownRows:
        """Rows of a design (r, all columns), with residual (r,), covariance (r, r)."""
        columns = np.flatnonzero(design.any(axis=0))
        root = np.linalg.cholesky(covariance)
        return cls(
            columns, np.linalg.solve(root, design[:, columns]),
            np.linalg.solve(root, residual),
        )  # fmt: skip

    @classmethod
    def concatenated(cls, parts: Sequence[KnownRows]) -> KnownRows:
        """Concatenate several sets of rows, which are independent."""
        columns = np.unique(np.concatenate([known.columns for known in parts]))
        design = []
        for known in parts:
            part = np.zeros((len(known.residual), len(columns)))
            part[:, np.searchsorted(columns, known.columns)] = known.design
            design.append(part)
        residual = np.concatenate([known.residual for known in parts])
        return cls(columns, np.vstack(design), residual)
