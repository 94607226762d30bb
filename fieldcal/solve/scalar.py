"""Accelerometers from positions of unknown orientation: the force at rest is g.

    U_i = b + M f_i + e_i,   |f_i| = g,   cov e_i = C_i
    M = [[kx, k12, k13], [0, ky, k23], [0, 0, kz]]

The direction of f_i is not known: it is a nuisance of each position. Minimising over it
leaves one equation a position, the error along the direction n_i that the fit itself
gives (errors in variables, to first order in |e| / g):

    r_i = |F_i| - g,  F_i = M^-1 (U_i - b),  n_i = F_i / |F_i|,  a_i = M^-T n_i
    var r_i = a_i^T C_i a_i,   dr_i / db = -a_i,   dr_i / dM_jk = -a_ij F_ik

Norms know nothing of a common rotation, so M can have no more than six numbers; the
upper triangle means that the z accelerometer's axis is the z axis of the frame, and
that of y lies in its y z plane. Without `cross` M is diagonal. b, U in m/s^2, device
axes.
Source: Shin and El-Sheimy 2002, for the equation; Fuller 1987, for the weights.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fieldcal.errors import NotObservable
from fieldcal.samples import Array
from fieldcal.solve import linear, scatter
from fieldcal.solve.estimate import NO_DOF, Estimate, axes, join
from fieldcal.solve.observations import ACC, Observations

UPPER = ((0, 1), (0, 2), (1, 2))
NAMES = (
    *axes("acc_bias"), *axes("acc_scale"),
    *(f"cross_coupling.k{i + 1}{j + 1}" for i, j in UPPER),
)  # fmt: skip
FEW = {1: "one degree of freedom", 2: "two degrees of freedom"}
STEPS = 50
SMALL = 1e-8
"""Relative step from which the fit counts as done."""

USELESS = 0.1
"""A coupling less well known than this is not offered."""


@dataclass(frozen=True, slots=True)
class NormFit:
    """Fit of norms.

    Attributes
    ----------
    x : (p,) bias, scale factors, upper couplings; nan where not determined
    covariance : (p, p)
    residual : (n,) m/s^2
    sigma : (n,) standard uncertainty of the residual's noise
    left_out : (n,) residual of each position by a fit without it, m/s^2
    gain : (p, n) derivative of x by the norms
    along : (n, 3) derivative of the norms by the means
    determined : (p,)
    chi2, dof : weighted sum of squares; positions less rank

    """

    x: Array
    covariance: Array
    residual: Array
    sigma: Array
    left_out: Array
    gain: Array
    along: Array
    determined: linear.Mask
    chi2: float
    dof: int


def scalar(observations: Observations, cross: bool = False) -> Estimate:
    """Bias and scale factor from |f| = g; with `cross` the non-orthogonality.

    Parameters
    ----------
    observations : n positions at rest, angles not used
    cross : estimate k12, k13, k23 as well

    Raises
    ------
    NotObservable
        If no parameter is determined.

    """
    free = np.arange(9) < (9 if cross else 6)
    notes = []
    if cross:
        whole = _fit(observations, free)
        kept = _known(whole)
        if not kept[6:].all():
            notes.append(_hidden(observations, kept, whole.dof))
            free = kept
    found = scatter.absorb(
        lambda seen: _estimate(_fit(seen, free)), observations, ACC, "norms"
    )
    if not found.names:
        raise NotObservable("; ".join((*notes, *found.warnings)))
    return replace(found, warnings=(*notes, *found.warnings))


def fit_norms(
    y: Array, noise: Array, gravity: float, start: Array, free: linear.Mask
) -> NormFit:
    """Weighted fit of the norms.

    Parameters
    ----------
    y : (n, 3) means, m/s^2
    noise : (n, 3, 3) their covariances
    gravity : m/s^2
    start : (6,) bias and scale factors to start from
    free : (9,) which of `NAMES` are estimated; the others stay 0

    """
    x = np.zeros(9)
    x[:6] = start
    r, rows, along = norms(y, gravity, x)
    for _ in range(STEPS):
        sigma = _sigma(along, noise)
        inverse, _, _, _ = linear.decompose(rows[:, free] / sigma[:, None])
        step = np.zeros(9)
        step[free] = -inverse @ (r / sigma)
        cost = float(((r / sigma) ** 2).sum())
        for halving in range(12):
            moved = x + step / 2**halving
            trial = norms(y, gravity, moved)
            if ((trial[0] / sigma) ** 2).sum() <= cost * (1 + 1e-12):
                break
        x, (r, rows, along) = moved, trial
        if np.abs(step[:3]).max() < SMALL * gravity and np.abs(step[3:]).max() < SMALL:
            break
    sigma = _sigma(along, noise)
    return _finished(x, r, rows / sigma[:, None], along, sigma, free)


def norms(y: Array, gravity: float, x: Array) -> tuple[Array, Array, Array]:
    """Residual of the norms, its design and its derivative by the means.

    Parameters
    ----------
    y : (n, 3) means, m/s^2
    gravity : m/s^2
    x : (9,) in the order of `NAMES`

    Returns
    -------
    r : (n,) m/s^2
    rows : (n, 9) dr / dx
    along : (n, 3) dr / dy

    """
    matrix = np.diag(x[3:6])
    for value, (i, j) in zip(x[6:], UPPER, strict=True):
        matrix[i, j] = value
    inverse = np.linalg.inv(matrix)
    force = (y - x[:3]) @ inverse.T
    length = np.linalg.norm(force, axis=1)
    along = force / length[:, None] @ inverse
    couplings = [along[:, i] * force[:, j] for i, j in UPPER]
    rows = -np.column_stack([along, along * force, *couplings])
    return length - gravity, rows, along


def _sigma(along: Array, noise: Array) -> Array:
    variance: Array = np.einsum("ni,nij,nj->n", along, noise, along)
    return np.sqrt(variance)


def _finished(
    x: Array, r: Array, rows: Array, along: Array, sigma: Array, free: linear.Mask
) -> NormFit:
    """Covariance, rank and leave-one-out residuals of the last step."""
    inverse, known, kept, _ = linear.decompose(rows[:, free])
    places = np.flatnonzero(free)
    determined = np.zeros(9, dtype=bool)
    determined[places[known]] = True
    gain = np.zeros((9, len(r)))
    gain[places] = -inverse / sigma
    covariance = np.zeros((9, 9))
    covariance[np.ix_(places, places)] = inverse @ inverse.T
    hat = np.einsum("np,pn->n", rows[:, free], inverse)
    # a position that alone determines something has no residual to be judged by
    left_out = np.where(hat < 1 - 1e-9, r / np.maximum(1 - hat, 1e-9), np.nan)
    chi2 = float(((r / sigma) ** 2).sum())
    return NormFit(
        x, covariance, r, sigma, left_out, gain, along, determined, chi2,
        len(r) - len(kept),
    )  # fmt: skip


def _known(fit: NormFit) -> linear.Mask:
    """Which parameters to keep when couplings were asked for."""
    sigma = np.sqrt(np.diag(fit.covariance))
    kept = fit.determined & (sigma < USELESS)
    # without the couplings bias and scale factor may well be determined
    kept[:6] = True
    if not fit.determined[:6].all():
        kept[6:] = False
    return kept


def _fit(observations: Observations, free: linear.Mask) -> NormFit:
    nominal = observations.nominal
    return fit_norms(
        observations.mean[:, ACC],
        observations.covariance[:, ACC, ACC],
        observations.gravity,
        np.array([*nominal.acc_bias, *nominal.acc_scale]),
        free,
    )


def _estimate(fit: NormFit) -> Estimate:
    notes = _few(fit.dof)
    if not fit.determined[:6].all():
        notes.append(_orientations(fit.determined))
    whole = Estimate(
        NAMES, fit.x, fit.covariance, fit.chi2, fit.dof,
        float(np.sqrt(np.average(fit.residual**2, weights=fit.sigma**-2))),
        fit.gain[:, :, None] * fit.along, tuple(notes),
        {"left_out_rms": _rms(fit.left_out)},
    )  # fmt: skip
    return whole.only(fit.determined)


def _rms(values: Array) -> float | None:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else None


def _hidden(observations: Observations, kept: linear.Mask, dof: int) -> str:
    """Say which couplings these orientations do not show, and which would."""
    hidden = [i for i in range(6, 9) if not kept[i]]
    between = [f"{'xyz'[i]} and {'xyz'[j]}" for i, j in (UPPER[h - 6] for h in hidden)]
    why = "axes held up and down alone cannot show it"
    if len(observations) < 9:
        why = f"{len(observations)} norms cannot carry 9 parameters"
    elif dof in FEW:
        why += f" (and all nine would leave {FEW[dof]})"
    return (
        f"{join([NAMES[i] for i in hidden])} {'are' if hidden[1:] else 'is'} not "
        f"determined, {why}: add positions with gravity half way between "
        f"{join(between)}"
    )


def _orientations(determined: linear.Mask) -> str:
    missing = [NAMES[i] for i in range(6) if not determined[i]]
    verb = "are" if len(missing) > 1 else "is"
    return (
        f"{join(missing)} {verb} not determined by these orientations: add positions "
        "with each axis up and down"
    )


def _few(dof: int) -> list[str]:
    if dof <= 0:
        return [NO_DOF]
    if dof not in FEW:
        return []
    return [
        f"{FEW[dof]}: the residual says nothing about the fit; add positions in other "
        "orientations"
    ]
