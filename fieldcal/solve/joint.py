"""Joint estimate of the accelerometers: all positions, all parameters, one covariance.

The model is that of `design`, the fit that of `gauss_newton`, the doubt about single
positions that of `robust`. One fit of the 3n means for bias, scale factor, tilt and, if
asked, cross-coupling reaches the Cramer-Rao bound

    cov x >= (H^T C^-1 H)^-1,   H = du / dx,  C the windows' covariances

which the printed two-step solution (20), (26)-(34) misses several times over, because
it spends parameters on coefficients that are not independent. m/s^2, degrees, device
axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.errors import NotObservable
from fieldcal.positions import Position
from fieldcal.samples import Array
from fieldcal.solve import gauss_newton, linear, robust, scatter
from fieldcal.solve.design import Model, ladder_remedy
from fieldcal.solve.estimate import NO_DOF, Estimate, not_determined
from fieldcal.solve.observations import ACC, Observations

SUSPECT = 0.1
"""Probability of a position to be bad from which the operator is told."""

WRONG = 9.0
"""chi2 per degree of freedom from which the model, not the noise, is at fault."""


@dataclass(frozen=True, slots=True)
class Solution:
    """Joint estimates of one or many data sets; leading dimensions are the data's.

    Attributes
    ----------
    x : (..., p) parameters in the order of ``Model.names``
    covariance : (..., p, p)
    bad : (..., n) probability that a position is bad
    chi2 : (...) of the positions that are not certainly bad
    dof : (...) of the same
    fit : the last fit

    """

    x: Array
    covariance: Array
    bad: Array
    chi2: Array
    dof: Array
    fit: gauss_newton.Fit


def estimate(
    model: Model,
    positions: Sequence[Position],
    gravity: float,
    y: Array,
    noise: Array,
    *,
    mounting: Array | None = None,
    start: Array | None = None,
    prior: Array | None = None,
) -> Solution:
    """Fit means of one or many data sets of the same positions.

    Parameters
    ----------
    model : which parameters
    positions : n known positions
    gravity : m/s^2
    y : (..., n, 3) m/s^2, device axes
    noise : (n, 3, 3) or (..., n, 3, 3) their covariances
    mounting : (3, 3), procedure = mounting @ device
    start : (p,) where to start; a perfect device if not given
    prior : (p,) standard uncertainty about 0 of what was known before, else inf

    """
    n = len(positions)
    axes = np.eye(3) if mounting is None else mounting
    first = model.start if start is None else start
    of = gauss_newton.model_of(model, positions, gravity, axes)
    white = np.broadcast_to(linear.whitener(noise), (*y.shape[:-2], n, 3, 3))
    found = np.zeros(y.shape[:-1], dtype=bool)
    # one bad position of six can be told from scatter, two of six cannot
    for left in reversed(range(1 + max(1, n // 6))):
        fit = gauss_newton.solve(of, y, white, first, prior)
        basis, residual = fit.basis[..., : 3 * n, :], fit.white[..., : 3 * n]
        doubt = robust.doubt(
            basis.reshape(*y.shape[:-2], n, 3, -1), residual.reshape(y.shape)
        )
        fresh = robust.certain(doubt, found)
        if not (left and fresh.any()):
            break
        flagged = fresh.any(axis=-1)
        fresh[flagged] = _culprit(of, y[flagged], white[flagged], first, prior)
        found = found | fresh
        white = np.where(fresh[..., None, None], white / robust.WORSE[-1], white)
    moved = (fit.back @ doubt.shift[..., None])[..., 0]
    covariance = fit.back @ doubt.covariance @ np.swapaxes(fit.back, -1, -2)
    return Solution(
        fit.x + moved,
        covariance,
        np.where(found, 1.0, doubt.bad),
        fit.chi2,
        fit.dof - 3 * found.sum(axis=-1),
        fit,
    )


def _culprit(
    of: gauss_newton.Predict, y: Array, white: Array, start: Array, prior: Array | None
) -> linear.Mask:
    """The position of each fit without which the others agree best, (..., n).

    A gross error bends the fit so far that its linear updates point at the wrong one;
    these are whole fits.
    """
    n = y.shape[-2]
    chi2 = []
    for i in range(n):
        without = white.copy()
        without[..., i, :, :] /= robust.WORSE[-1]
        # the right one converges at once, the others need not converge
        chi2.append(gauss_newton.solve(of, y, without, start, prior, steps=5).chi2)
    best = np.argmin(chi2, axis=0)
    return np.asarray(np.arange(n) == best[..., None])


def joint(
    observations: Observations, model: Model, level_sigma: float | None = None
) -> Estimate:
    """Joint estimate with uncertainty, and with what the user must know about it.

    Parameters
    ----------
    observations : n positions at rest with known angles
    model : which parameters; a tilt that the positions do not determine is left out by
        name, like any other parameter
    level_sigma : how level the base was made before, degrees about each level axis;
        None where nothing is known

    Raises
    ------
    NotObservable
        If angles are missing, or no parameter is determined.

    """
    if not observations.oriented.all():
        raise NotObservable(
            "the joint estimate needs the angles of every position: the scalar method "
            "does without"
        )
    prior = _prior(model, level_sigma)
    noise = observations.covariance[:, ACC, ACC]
    solution = _run(observations, model, noise, prior)
    dof, chi2 = int(solution.dof), float(solution.chi2)
    notes = [_bad_position(observations, solution.bad)]
    factor, spread = 1.0, 0.0
    if scatter.chance(chi2, dof) < scatter.UNLIKELY:
        spread, solution = _scattered(observations, model, noise, prior)
        factor = scatter.student_ratio(dof)
        notes = [
            _bad_position(observations, solution.bad),
            scatter.excess("positions", chi2, dof, spread, "m/s^2"),
        ]
    determined = solution.fit.determined
    if not determined.all():
        notes.append(_undetermined(observations, model, determined))
    if dof == 0:
        notes.append(NO_DOF)
    residual = solution.fit.residual
    whole = Estimate(
        model.names,
        solution.x,
        solution.covariance * factor**2,
        chi2,
        dof,
        float(np.sqrt(np.mean(residual**2))),
        _gain(solution, noise + spread**2 * np.eye(3)),
        tuple(note for note in notes if note),
        {"bad_position": [round(float(p), 4) for p in solution.bad],
         "extra_scatter": spread},
    )  # fmt: skip
    if not determined.any():
        raise NotObservable("; ".join(whole.warnings))
    return whole.only(determined)


def _run(
    observations: Observations, model: Model, noise: Array, prior: Array | None
) -> Solution:
    start = model.start
    start[:3] = observations.nominal.acc_bias
    start[3:6] = observations.nominal.acc_scale
    return estimate(
        model,
        observations.positions,
        observations.gravity,
        observations.mean[:, ACC],
        noise,
        mounting=observations.mounting,
        start=start,
        prior=prior,
    )


def _scattered(
    observations: Observations, model: Model, noise: Array, prior: Array | None
) -> tuple[float, Solution]:
    """Extra scatter of all positions, m/s^2, and the solution with it in the noise.

    A position that is bad even then does not count for the scatter of the others.
    """
    y = observations.mean[:, ACC]
    of = gauss_newton.model_of(
        model, observations.positions, observations.gravity, observations.mounting
    )
    good = np.ones(len(y), dtype=bool)

    def chi2(spread: float) -> float:
        enlarged = noise + spread**2 * np.eye(3)
        enlarged[~good] *= robust.WORSE[-1] ** 2
        white = linear.whitener(enlarged)
        return float(gauss_newton.solve(of, y, white, model.start, prior).chi2)

    typical = float(np.sqrt(np.trace(noise, axis1=1, axis2=2).mean() / 3))
    for _ in range(2):
        bad = 3 * int((~good).sum())
        dof = _run(observations, model, noise, prior).fit.dof - bad
        spread = scatter.extra(chi2, dof, typical)
        solution = _run(
            observations, model, noise + spread**2 * np.eye(3), prior
        )  # fmt: skip
        worst = solution.bad > robust.CERTAIN
        if not worst.any():
            break
        good = ~worst
    return spread, solution


def _prior(model: Model, level_sigma: float | None) -> Array | None:
    """Standard uncertainty about 0 of each parameter, (p,)."""
    if level_sigma is None or model.tilt == "none":
        return None
    known = np.full(len(model.names), np.inf)
    known[-2:] = level_sigma
    return known


def _gain(solution: Solution, noise: Array) -> Array:
    """Derivative of the parameters by the means, (p, n, 3)."""
    n = len(noise)
    reach = np.swapaxes(solution.fit.basis[: 3 * n], -1, -2)
    gain = (solution.fit.back @ reach).reshape(-1, n, 3)
    weighted: Array = np.einsum("pnc,ncd->pnd", gain, linear.whitener(noise))
    return weighted


def _bad_position(observations: Observations, bad: Array) -> str:
    worst = int(bad.argmax())
    if bad[worst] < SUSPECT:
        return ""
    name = observations.positions[worst].name
    if bad[worst] > robust.CERTAIN:
        return (
            f"the position {name} disagrees with all others and was given no weight: "
            "take it again"
        )
    return (
        f"the position {name} may be disturbed (probability "
        f"{100 * bad[worst]:.0f} %) and has less weight, which the uncertainties "
        "include: take it again"
    )


def _undetermined(
    observations: Observations, model: Model, determined: linear.Mask
) -> str:
    missing = [n for n, d in zip(model.names, determined, strict=True) if not d]
    everything = np.ones(len(determined), dtype=bool)
    return not_determined(
        missing, ladder_remedy(observations, everything, model), "these positions"
    )
