"""The effects that were found, with numbers, evidence and aliases."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.samples import CHANNELS, Array, Index
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.findings.agreement import (
    ModelResiduals,
    rms_over_parts,
    root_mean_square,
)
from fieldcal.diagnosis.findings.calibrated import calibration_changes
from fieldcal.diagnosis.findings.instant import estimate_instant
from fieldcal.diagnosis.findings.random_sizes import random_sizes
from fieldcal.diagnosis.result import FoundEffect, Quantity
from fieldcal.effects import catalogue
from fieldcal.model import priors, thresholds
from fieldcal.model.causes.cause import Group
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.posterior.common_axes import in_common_axes, parameter_rows
from fieldcal.model.posterior.held_out import held_out_turn_residuals, turn_residual
from fieldcal.model.posterior.probabilities import ProbableCause
from fieldcal.model.system.fitted import FittedSet
from fieldcal.physics.effect import Scatter
from fieldcal.physics.shape import Shape


@dataclass(frozen=True, slots=True)
class CauseRemoval:
    """What changes when one cause is removed from the best set.

    Attributes
    ----------
    set : the best set without the cause
    residual : (n, 6) of that set
    squares : (6,) rise of the whitened squares of each channel
    turn_squares : rise of the whitened squares of all turns

    """

    set: Set
    residual: Array
    squares: Array
    turn_squares: float


def shows_mainly_in_turns(lost: CauseRemoval) -> bool:
    """Whether a cause explains nothing in windows, or less than it does in turns."""
    windows = float(np.nan_to_num(lost.squares).max())
    return windows < max(thresholds.STANDS_OUT**2, lost.turn_squares)


def remove_cause(explanation: Explanation, standing: ProbableCause) -> CauseRemoval:
    """Remove a cause, and calculate what its columns had explained."""
    best = explanation.best
    less = explanation.posterior.without(standing.name)
    reduced = replace(best, set=less)
    residual = reduced.residual(reduced.deterministic_estimate)
    now = best.squares_of(best.residual(best.deterministic_estimate))
    turned = _squares_of_turns(explanation, reduced) - _squares_of_turns(
        explanation, best
    )
    return CauseRemoval(less, residual, best.squares_of(residual) - now, turned)


def _squares_of_turns(explanation: Explanation, fitted: FittedSet) -> float:
    """Whitened squares of all turns."""
    values = fitted.estimate
    parts = (turn_residual(t, values) for t in explanation.inferred.turn_rows)
    return float(sum(part @ part for part in parts))


def effect_of_cause(
    explanation: Explanation,
    standing: ProbableCause,
    lost: CauseRemoval,
    then: ModelResiduals,
) -> FoundEffect:
    """The effect of a probable cause of the catalogue, with numbers and evidence."""
    posterior = explanation.posterior
    delta = 2 * (
        posterior.best.state.score - _score_at_instability(lost.set, posterior.best)
    )
    count = sum(len(g.columns) for _, g in standing.members)
    count += sum(len(g.shape) for _, g in standing.members[:1])
    used = int(explanation.rows.used.sum())
    evidence = {
        "delta_chi2": delta,
        "delta_bic": delta - count * float(np.log(used)),
        "held_out_gain": _held_out_gain(explanation, standing, lost, then),
        "log_evidence": posterior.evidence(posterior.best)
        - posterior.evidence(lost.set),
    }
    known = tuple(n for n in standing.aliases if n in catalogue())
    return FoundEffect(
        standing.name, parameter_estimates(explanation, standing), known, evidence,
        standing.probability, calibration_changes(explanation, lost.set),
    )  # fmt: skip


def _score_at_instability(less: Set, best: Set) -> float:
    """Log evidence of a set with the instabilities of another."""
    rows = best.state.rows
    return type(less.state).of(rows, less.state.columns, less.state.prior_sigma).score


def parameter_estimates(
    explanation: Explanation, standing: ProbableCause
) -> dict[str, Quantity]:
    """Parameters of a cause that the rows determine, averaged over sets."""
    effect = catalogue()[standing.name]
    if isinstance(effect, Scatter):
        return random_sizes(explanation, standing)
    out: dict[str, Quantity] = {}
    for member in standing.members:
        group, best = member[1], explanation.best.set
        free = bool(explanation.dictionary.unoriented.all())
        if free:
            group = in_common_axes(best, group)
        told = (member[0], group)
        value, covariance = explanation.model_average.average_of_member(told)
        rows = parameter_rows(best, told, turned=free)
        prior = np.sqrt(rows**2 @ best.state.prior_sigma**2)
        own: dict[str, Quantity] = {}
        sigma = np.sqrt(np.diag(covariance))
        for j, v, s, wide in zip(group.params, value, sigma, prior, strict=True):
            if s**2 < thresholds.DETERMINED * wide**2:
                name = effect.params[j].name
                own[name] = Quantity(float(v), float(s), effect.params[j].unit)
        if free:
            own = merge_turned_parameters(group, value, covariance, prior, own)
        out |= _with_arrival_uncertainty(own, group)
    for shape in effect.shapes:
        known = [m for m in standing.members if shape.name in m[1].shape]
        if shape.kind == "instant":
            known = known[:1]  # estimated from all channels together
        shapes = [shape_estimate(explanation, m, shape) for m in known]
        weight = np.array([1 / max(error, 1e-12) ** 2 for _, error in shapes])
        at = float(weight @ [at for at, _ in shapes] / weight.sum())
        out[shape.name] = Quantity(at, float(weight.sum() ** -0.5), shape.unit)
    return out


def merge_turned_parameters(
    group: Group,
    value: Array,
    covariance: Array,
    prior: Array,
    own: dict[str, Quantity],
) -> dict[str, Quantity]:
    """Replace two parameters by their sum where only the sum is determined.

    If the orientation of the device is unknown, a turn of the whole device changes some
    parameters into each other, and only their sum is seen. Where the sum is better
    determined than either, it takes the place of both; where the search took only one
    of them, that is the sum.

    Parameters
    ----------
    group : of an effect
    value, covariance, prior : (k,), (k, k), (k,) of its parameters; `prior` is their
        standard deviation before the rows
    own : its parameters by name

    """
    effect, out = group.effect, dict(own)
    if effect is None:
        return out
    names = group.names
    for gone, kept in effect.turned_into.items():
        if kept not in names and gone in out:
            out[kept] = out.pop(gone)
        if not {gone, kept} <= set(names):
            continue
        at = [names.index(gone), names.index(kept)]
        cov, before = covariance[np.ix_(at, at)], float((prior[at] ** 2).sum())
        if cov.sum() < min(np.diag(cov).min(), thresholds.DETERMINED * before):
            out.pop(gone, None)
            total, sigma = value[at].sum(), np.sqrt(cov.sum())
            out[kept] = Quantity(float(total), float(sigma), effect.unit(kept))
    return {p.name: out[p.name] for p in effect.params if p.name in out}


def _with_arrival_uncertainty(
    found: dict[str, Quantity], group: Group
) -> dict[str, Quantity]:
    """Add the uncertainty of the end of the turn to amplitudes that decay from it."""
    shapes = group.effect.shapes if group.effect else ()
    fading = (group.shape[s.name] for s in shapes if s.kind in ("turn", "joint"))
    tau = next(fading, np.inf)
    part = priors.ARRIVAL_S / max(tau, priors.ARRIVAL_S)
    return {
        name: Quantity(q.value, float(np.hypot(q.sigma, q.value * part)), q.unit)
        for name, q in found.items()
        if isinstance(q.value, float) and q.sigma is not None
    }


def shape_estimate(
    explanation: Explanation, member: Member, shape: Shape
) -> tuple[float, float]:
    """A shape parameter and its standard uncertainty.

    An instant is estimated from the samples, other shapes by the search.
    """
    if shape.kind == "instant":
        return estimate_instant(explanation, member)
    _, group = member
    return group.shape[shape.name], group.shape_sigma(shape.name)


def column_estimates(fitted: Set, columns: Index) -> tuple[Array, Array, Array]:
    """Value, sigma and prior standard deviation of some columns of a set."""
    at = fitted.state.places_of(columns)
    value, sigma = fitted.state.estimate[at], np.sqrt(np.diag(fitted.state.inverse)[at])
    return value, sigma, fitted.state.prior_sigma[at]


def _held_out_gain(
    explanation: Explanation,
    standing: ProbableCause,
    lost: CauseRemoval,
    then: ModelResiduals,
) -> float:
    """Part of the held-out rms that a cause removes.

    A random effect predicts no value, but the scatter of values. For it, the gain is
    that reduction of an rms which would raise the density of the held-out rows as much.
    """
    if not isinstance(catalogue()[standing.name], Scatter):
        return held_out_rms_gain(explanation, lost, then)
    held_out, best = explanation.held_out, explanation.best.set
    rise = held_out.density(best) - held_out.density(lost.set)
    channels = [c for _, g in standing.members for c in _scattered_channels(g)]
    rows = int(explanation.rows.used[:, np.unique(channels)].sum())
    return float(1 - np.exp(-rise / rows))


def _scattered_channels(group: Group) -> tuple[int, ...]:
    """Channels that a random effect scatters: its own, or the accelerometers."""
    effect = group.effect
    of_outputs = effect is not None and len(effect.params) == len(CHANNELS)
    return group.params if of_outputs else (0, 1, 2)


def held_out_rms_gain(
    explanation: Explanation, lost: CauseRemoval, then: ModelResiduals
) -> float:
    """Part of the held-out rms that is removed, in the channel with the most effect."""
    best, turned = explanation.best, explanation.inferred.turn_rows
    if shows_mainly_in_turns(lost):
        reduced = replace(best, set=lost.set)
        without = root_mean_square(held_out_turn_residuals(reduced, turned))
        return float(1 - root_mean_square(explanation.turns_held_out) / without)
    ahead = rms_over_parts(best.rows, explanation.held_out.residual([lost.set]))
    now = then.held_out_rms
    share = np.where(np.isfinite(now) & (ahead > 0), lost.squares, -1.0)
    c = int(np.argmax(share))
    return float(1 - now[c] / ahead[c]) if share[c] > 0 else np.nan
