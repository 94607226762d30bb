"""Weighted Gauss-Newton for the accelerometers' means, many data sets at once.

    minimise over x   sum_i |L_i^-1 (U_i - u_i(x))|^2 + sum_j (x_j / s_j)^2

U_i (n, 3) means, L_i L_i^T their covariances, u the model of `design`, s_j what was
known of a tilt before. Each step solves the linearised problem by singular values of
the scaled design, so a direction that the positions do not determine is left where it
started instead of running away; steps that make the sum larger are halved.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.positions import Position
from fieldcal.samples import Array
from fieldcal.solve import linear
from fieldcal.solve.design import Model, predict

Predict = Callable[[Array], tuple[Array, Array]]
STEPS = 30
SMALL = 1e-4
"""Step, in units of the standard uncertainty, from which the fit counts as done."""


@dataclass(frozen=True, slots=True)
class Fit:
    """Solution of one or many fits; leading dimensions are those of the data.

    Attributes
    ----------
    x : (..., p)
    residual : (..., n, 3) m/s^2
    white : (..., m) weighted residual, the priors' last
    basis : (..., m, r) orthonormal columns that the parameters can reach
    back : (..., p, r) x changes by back @ z when the weighted data change by basis @ z
    determined : (p,) bool
    condition : of the scaled design

    """

    x: Array
    residual: Array
    white: Array
    basis: Array
    back: Array
    determined: linear.Mask
    condition: float

    @property
    def chi2(self) -> Array:
        """Weighted sum of squares, (...)."""
        return np.asarray((self.white**2).sum(axis=-1))

    @property
    def dof(self) -> int:
        """Equations, priors counted, less rank."""
        return int(self.basis.shape[-2] - self.basis.shape[-1])

    @property
    def covariance(self) -> Array:
        """Of x, (..., p, p), where determined."""
        return np.asarray(self.back @ np.swapaxes(self.back, -1, -2))


def model_of(
    model: Model, positions: Sequence[Position], gravity: float, mounting: Array
) -> Predict:
    """Prediction and design of parameters (..., p) for fixed positions."""
    return lambda x: predict(model, positions, gravity, mounting, x)


def solve(
    model: Predict,
    y: Array,
    white: Array,
    start: Array,
    prior: Array | None = None,
    steps: int = STEPS,
) -> Fit:
    """Fit parameters to means.

    Parameters
    ----------
    model : from `model_of`
    y : (..., n, 3) m/s^2
    white : (..., n, 3, 3) inverse Cholesky factors
    start : (p,) or (..., p)
    prior : (p,) standard uncertainty about 0; inf where nothing is known
    steps : at most this many

    """
    batch = y.shape[:-2]
    x = np.broadcast_to(start, (*batch, start.shape[-1])).copy()
    held = np.full(x.shape[-1], np.inf) if prior is None else prior
    rows, r, residual = _weighted(model, y, white, x, held)
    cost = (r**2).sum(axis=-1)
    for _ in range(steps):
        basis, back = _decompose(rows)
        z = np.swapaxes(basis, -1, -2) @ r[..., None]
        step = (back @ z)[..., 0]
        x, rows, r, residual, cost = _descend(model, y, white, held, x, cost, step)
        if float(np.abs(z).max(initial=0.0)) < SMALL:
            break
    basis, back = _decompose(rows)
    first = rows.reshape(-1, *rows.shape[-2:])[0]
    _, determined, kept, _ = linear.decompose(first)
    condition = float(kept[0] / kept[-1]) if len(kept) else np.inf
    return Fit(x, residual, r, basis, back, determined, condition)


def _descend(
    model: Predict,
    y: Array,
    white: Array,
    held: Array,
    x: Array,
    cost: Array,
    step: Array,
) -> tuple[Array, Array, Array, Array, Array]:
    """Take the step, halved for those fits whose sum of squares it would raise."""
    length = np.ones(x.shape[:-1])
    for _ in range(8):
        moved = x + length[..., None] * step
        rows, r, residual = _weighted(model, y, white, moved, held)
        new = (r**2).sum(axis=-1)
        worse = new > cost * (1 + 1e-9) + 1e-12
        if not worse.any():
            break
        length = np.where(worse, length / 2, length)
    return moved, rows, r, residual, new


def _weighted(
    model: Predict, y: Array, white: Array, x: Array, held: Array
) -> tuple[Array, Array, Array]:
    """Weighted design (..., m, p), its residual (..., m), and y - u, (..., n, 3)."""
    u, design = model(x)
    p = x.shape[-1]
    rows = (white @ design).reshape(*x.shape[:-1], -1, p)
    residual = y - u
    r = (white @ residual[..., None]).reshape(*x.shape[:-1], -1)
    known = np.flatnonzero(np.isfinite(held))
    if len(known):
        extra = np.broadcast_to(np.eye(p)[known] / held[known, None],
                                (*x.shape[:-1], len(known), p))  # fmt: skip
        rows = np.concatenate([rows, extra], axis=-2)
        r = np.concatenate([r, -x[..., known] / held[known]], axis=-1)
    return rows, r, residual


def _decompose(rows: Array) -> tuple[Array, Array]:
    """Orthonormal basis (..., m, r) and way back to the parameters (..., p, r)."""
    scale = np.linalg.norm(rows, axis=-2, keepdims=True)
    longest = scale.max(axis=-1, keepdims=True)
    scale = np.where(scale > linear.ROUNDING * longest, scale, np.inf)
    u, s, vt = np.linalg.svd(rows / scale, full_matrices=False)
    # one rank for all fits: they differ in noise, not in positions
    rank = int((s > linear.RCOND * s[..., :1]).sum(axis=-1).min())
    v = np.swapaxes(vt[..., :rank, :], -1, -2)
    return u[..., :rank], v / s[..., None, :rank] / np.swapaxes(scale, -1, -2)
