"""Weighted linear least squares by singular values, rank first.

    y = H x + e,  cov e = C = L L^T,  A = L^-1 H D = U S V^T
    x = D V S^-1 U^T L^-1 y,  cov x = D V S^-2 V^T D

D scales the columns of L^-1 H to length one, so that the rank does not depend on
units. Directions whose singular value is below `RCOND` of the largest are not
determined; a parameter with a component along one of them is reported as such, and the
others keep the values they would have with any value of it. Source: G. H. Golub and
C. F. Van Loan, Matrix Computations, 5.5.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from fieldcal.errors import InputError
from fieldcal.samples import Array

T = TypeVar("T")

Mask = NDArray[np.bool_]

RCOND = 1e-7
"""Ratio of singular values below which a direction counts as not determined."""

ROUNDING = 1e-12
"""Length of a column, as a share of the longest, that counts as zero."""

LEAK = 1e-4
"""Share of a null direction above which a parameter counts as not determined."""


@dataclass(frozen=True, slots=True)
class LinearFit:
    """Solution of m equations in p unknowns.

    Attributes
    ----------
    values : (p,), nan where not determined
    covariance : (p, p), nan in rows and columns not determined
    gain : (p, m), values = gain @ y for what is determined
    determined : (p,) bool
    residual : (m,) y - H x
    chi2, dof : weighted sum of squares, equations less rank
    condition : ratio of the largest to the smallest singular value kept

    """

    values: Array
    covariance: Array
    gain: Array
    determined: Mask
    residual: Array
    chi2: float
    dof: int
    condition: float


def whitener(covariance: Array) -> Array:
    """Inverse Cholesky factors L^-1 of covariances, (..., k, k).

    Raises
    ------
    InputError
        If one of them is not positive definite.

    """
    try:
        return np.linalg.inv(np.linalg.cholesky(covariance))
    except np.linalg.LinAlgError:
        raise InputError(
            "a window's covariance is not positive definite: its means have no "
            "uncertainty, so the window cannot be weighted"
        ) from None


def decompose(design: Array) -> tuple[Array, Mask, Array, Array]:
    """Scaled singular value decomposition of (m, p): pseudo-inverse and rank.

    Returns
    -------
    inverse : (p, m) pseudo-inverse
    determined : (p,) bool
    kept : singular values above the limit
    null : (p, k) directions not determined, in scaled parameters

    """
    scale = np.linalg.norm(design, axis=0)
    # sin(180°) is not quite zero: what is left of such a column is rounding
    scale = np.where(scale > ROUNDING * scale.max(initial=0.0), scale, np.inf)
    # of few rows the full set of directions is needed to see the null space
    u, s, vt = np.linalg.svd(design / scale, full_matrices=True)
    rank = int((s > RCOND * max(float(s.max(initial=0.0)), 1e-300)).sum())
    inverse = (vt[:rank].T / s[:rank]) @ u[:, :rank].T / scale[:, None]
    null = vt[rank:].T
    determined = (np.abs(null) < LEAK).all(axis=1)
    return inverse, determined, s[:rank], null


def fit(design: Array, y: Array, white: Array) -> LinearFit:
    """Solve y = design @ x.

    Parameters
    ----------
    design : (n, c, p) rows of n positions with c channels each
    y : (n, c)
    white : (n, c, c) from `whitener`

    """
    p = design.shape[-1]
    a = (white @ design).reshape(-1, p)
    b = (white @ y[..., None]).reshape(-1)
    inverse, determined, kept, _ = decompose(a)
    values = inverse @ b
    residual = y - design @ values
    weighted = b - a @ values
    gain = np.einsum("pnc,ncd->pnd", inverse.reshape(p, *y.shape), white)
    out = ~determined
    covariance = inverse @ inverse.T
    covariance[out] = covariance[:, out] = np.nan
    return LinearFit(
        np.where(determined, values, np.nan),
        covariance,
        gain.reshape(p, -1),
        determined,
        residual.ravel(),
        float(weighted @ weighted),
        len(b) - len(kept),
        float(kept[0] / kept[-1]) if len(kept) else np.inf,
    )


def fit_beside(design: Array, y: Array, covariance: Array, unknown: Array) -> LinearFit:
    """Fit of y beside unknown factors, which are folded into its covariance.

    Parameters
    ----------
    design : (n, 3, p)
    y : (n, 3)
    covariance : (n, 3, 3) of y
    unknown : (n, 3, k) columns of factors of mean 0 and variance 1

    """
    n = len(y)
    columns = unknown.reshape(3 * n, -1)
    noise = columns @ columns.T
    for i, block in enumerate(covariance):
        noise[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] += block
    rows = design.reshape(1, 3 * n, -1)
    return fit(rows, y.reshape(1, -1), whitener(noise)[None])


def remedy(
    rows: Callable[[Sequence[T]], Array],
    taken: Sequence[T],
    candidates: Sequence[T],
    wanted: Mask,
) -> list[T]:
    """Additions that would determine what is missing, fewest first.

    Parameters
    ----------
    rows : design of places, (n, c, p)
    taken : the places there are
    candidates : places that could be added
    wanted : (p,) bool, the parameters that are to be determined

    """
    extra: list[T] = []

    def count(places: Sequence[T]) -> int:
        design = rows(places)
        _, determined, kept, _ = decompose(design.reshape(-1, design.shape[-1]))
        # ties go to what raises the rank without yet freeing a whole parameter
        return int((determined & wanted).sum()) * 1000 + len(kept)

    have = count(taken)
    while len(extra) < 4:
        if have // 1000 == int(wanted.sum()):
            return extra
        score, best = max(
            ((count([*taken, *extra, c]), -i) for i, c in enumerate(candidates)),
        )
        if score <= have:
            break
        have = score
        extra.append(candidates[-best])
    return extra if have // 1000 == int(wanted.sum()) else []
