"""Prior knowledge of columns, as rows in addition to those of the recording.

    off = design u + e,    e ~ N(0, 1)                                              (1)

They count as any other rows do, in the estimate and in the evidence of every set.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array, Index


@dataclass(frozen=True, slots=True, eq=False)
class KnownRows:
    """Rows (1), divided by what each is uncertain by.

    Attributes
    ----------
    columns : (k,) of the dictionary
    design : (r, k)
    off : (r,)

    """

    columns: Index
    design: Array
    off: Array

    @classmethod
    def of(cls, design: Array, off: Array, covariance: Array) -> KnownRows:
        """Rows (r, all) with values (r,) of some covariance (r, r)."""
        columns = np.flatnonzero(design.any(axis=0))
        root = np.linalg.cholesky(covariance)
        return cls(
            columns, np.linalg.solve(root, design[:, columns]),
            np.linalg.solve(root, off),
        )  # fmt: skip
