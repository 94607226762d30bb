"""The effects that were found, with numbers, evidence and aliases."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import CHANNELS, Array, Index
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.findings.agreement import Agreement
from fieldcal.diagnosis.findings.calibrated import moved
from fieldcal.diagnosis.findings.instant import instant
from fieldcal.diagnosis.findings.stretch_means import rms
from fieldcal.diagnosis.result import FoundEffect, Quantity
from fieldcal.diagnosis.signal.line import Tone
from fieldcal.effects import catalogue
from fieldcal.model import priors, thresholds
from fieldcal.model.causes.cause import Group
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import Member, likeliest, likeliest_of_axis
from fieldcal.model.posterior.held_out import turn_residual, turns_held_out
from fieldcal.model.posterior.probabilities import Standing
from fieldcal.model.system.fitted import Fitted
from fieldcal.physics.effect import Param, Scatter
from fieldcal.physics.recording import Fault


@dataclass(frozen=True, slots=True)
class Removed:
    """What is lost when one cause is taken out.

    Attributes
    ----------
    set : without it
    residual : (n, 6) of that
    squares : (6,) by how much the whitened squares of each channel rise
    turned : by how much those of the turns do

    """

    set: Set
    residual: Array
    squares: Array
    turned: float


def in_turns(lost: Removed) -> bool:
    """Whether windows lose nothing with a cause, or less than turns do."""
    windows = float(np.nan_to_num(lost.squares).max())
    return windows < max(thresholds.STANDS_OUT**2, lost.turned)


def rms_of(values: Array) -> float:
    """Root mean square; nan of nothing."""
    return float(np.sqrt(np.mean(values**2))) if len(values) else np.nan


def removed(explanation: Explanation, standing: Standing) -> Removed:
    """Take a cause out, and see what its columns had taken."""
    best = explanation.best
    less = explanation.posterior.without(standing.name)
    there = Fitted(best.rows, best.dictionary, best.linear, best.values, less)
    residual = there.residual(there.certain)
    now = best.squares_of(best.residual(best.certain))
    turned = _of_turns(explanation, there) - _of_turns(explanation, best)
    return Removed(less, residual, best.squares_of(residual) - now, turned)


def _of_turns(explanation: Explanation, fitted: Fitted) -> float:
    """Whitened squares of all turns."""
    values = fitted.estimate
    parts = (turn_residual(t, values) for t in explanation.inferred.turned)
    return float(sum(part @ part for part in parts))


def of_rows(
    explanation: Explanation, standing: Standing, lost: Removed, then: Agreement
) -> FoundEffect:
    """A cause of the catalogue that windows or turns show."""
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
        standing.name,
        parameters(explanation, standing),
        known,
        evidence,
        standing.probability,
        moved(explanation, lost.set),
    )


def _score_at_instability(less: Set, best: Set) -> float:
    """Score of a set at the instabilities of another."""
    rows = best.state.rows
    return type(less.state).of(rows, less.state.columns, less.state.sizes).score


def parameters(explanation: Explanation, standing: Standing) -> dict[str, Quantity]:
    """Numbers of a cause, as far as the rows determine them."""
    effect = catalogue()[standing.name]
    if isinstance(effect, Scatter):
        return sizes(explanation, standing)
    out: dict[str, Quantity] = {}
    for member in standing.members:
        group = member[1]
        value, covariance = explanation.average.of_member(member)
        _, _, prior = estimates(explanation.best.set, group.columns)
        own: dict[str, Quantity] = {}
        sigma = np.sqrt(np.diag(covariance))
        for j, v, s, wide in zip(group.params, value, sigma, prior, strict=True):
            if s**2 < thresholds.DETERMINED * wide**2:
                name = effect.params[j].name
                own[name] = Quantity(float(v), float(s), effect.params[j].unit)
        if explanation.dictionary.free.all():
            own = whatever_turned(group, value, covariance, prior, own)
        out |= _since_arrival(own, group)
    for shape in effect.shapes:
        known = [m for m in standing.members if shape.name in m[1].shape]
        if shape.kind == "instant":
            known = known[:1]  # by all channels already
        found = [shape_of(explanation, m) for m in known]
        weight = np.array([1 / max(error, 1e-12) ** 2 for _, error in found])
        at = float(weight @ [at for at, _ in found] / weight.sum())
        out[shape.name] = Quantity(at, float(weight.sum() ** -0.5), shape.unit)
    return out


def whatever_turned(
    group: Group,
    value: Array,
    covariance: Array,
    prior: Array,
    own: dict[str, Quantity],
) -> dict[str, Quantity]:
    """Numbers of a device of which nobody knows how it stands.

    What a turn of the whole device makes of two parameters is seen by their sum: where
    that is better known than either, it is in the place of both.

    Parameters
    ----------
    group : of an effect
    value, covariance, prior : (k,), (k, k), (k,) of its parameters; their sizes before
    own : its numbers by name

    """
    effect, out = group.effect, dict(own)
    if effect is None:
        return out
    names = [effect.params[j].name for j in group.params]
    for gone, kept in effect.turned_into.items():
        if not {gone, kept} <= set(names):
            continue
        at = [names.index(gone), names.index(kept)]
        cov, before = covariance[np.ix_(at, at)], float((prior[at] ** 2).sum())
        if cov.sum() < min(np.diag(cov).min(), thresholds.DETERMINED * before):
            out.pop(gone, None)
            total, sigma = value[at].sum(), np.sqrt(cov.sum())
            out[kept] = Quantity(float(total), float(sigma), effect.unit(kept))
    return out


def _since_arrival(found: dict[str, Quantity], group: Group) -> dict[str, Quantity]:
    """Amplitudes with the uncertainty of the instant that they are counted from."""
    shapes = group.effect.shapes if group.effect else ()
    fading = (group.shape[s.name] for s in shapes if s.kind in ("turn", "joint"))
    tau = next(fading, np.inf)
    part = priors.ARRIVAL_S / max(tau, priors.ARRIVAL_S)
    return {
        name: Quantity(q.value, float(np.hypot(q.sigma, q.value * part)), q.unit)
        for name, q in found.items()
        if isinstance(q.value, float) and q.sigma is not None
    }


def shape_of(explanation: Explanation, member: Member) -> tuple[float, float]:
    """A shape parameter and its standard uncertainty; an instant from the samples."""
    _, group = member
    (value,) = group.shape.values()
    (shape,) = group.effect.shapes  # type: ignore[union-attr]
    if shape.kind == "instant":
        return instant(explanation, member)
    return value, min(group.unsure, value)


def estimates(found: Set, columns: Index) -> tuple[Array, Array, Array]:
    """Values, sigmas and sizes before the rows of some columns of a set."""
    at = _places(found, columns)
    value, sigma = found.state.estimate[at], np.sqrt(np.diag(found.state.inverse)[at])
    return value, sigma, found.state.sizes[at]


def _places(found: Set, columns: Index) -> Index:
    """Where columns stand in a set; a member's come last."""
    return np.array(
        [int(np.flatnonzero(found.state.columns == c)[-1]) for c in columns]
    )


def sizes(explanation: Explanation, standing: Standing) -> dict[str, Quantity]:
    """Sizes of what is random, each with its uncertainty.

    By the likeliest set alone: a covariance that is averaged over several sizes tells
    none of them.
    """
    best, out = explanation.posterior.best, dict[str, Quantity]()
    for member in standing.members:
        tried = float(priors.SIZES[best.sizes.members[best.members.index(member)]])
        out |= sizes_of(best, explanation.dictionary, member[1], tried)
    return out


def sizes_of(found: Set, d: Dictionary, group: Group, v: float) -> dict[str, Quantity]:
    """Sizes of a random group that has the size v in a set, axis by axis.

    Their uncertainty is from the information on ln v.
    """
    out = {}
    whole = likeliest(found.state, _places(found, group.columns), v)
    for param, at in _scattered(d, group):
        size, part = whole
        if len(at) < len(group.columns):
            size, part = likeliest_of_axis(found.state, _places(found, at), v, whole)
        size *= param.typical
        out[param.name] = Quantity(size, size * part, param.unit)
    return out


def _scattered(d: Dictionary, group: Group) -> Iterator[tuple[Param, Index]]:
    """Parameters of something random, with the columns that each scatters."""
    params = group.effect.params if group.effect else ()
    if not group.params:
        yield from ((one, group.columns) for one in params)
    for c in group.params:
        yield params[c], np.intersect1d(group.columns, d.wave(c, d.wander.modes[c]))


def _held_out_gain(
    explanation: Explanation, standing: Standing, lost: Removed, then: Agreement
) -> float:
    """Part of the held-out rms that goes with a cause.

    What is random foretells no value but how far values lie apart: of it, the part by
    which an rms would be less where what is left out is as much likelier.
    """
    if not isinstance(catalogue()[standing.name], Scatter):
        return gain(explanation, lost, then)
    held_out, there = explanation.held_out, explanation.best.set
    rise = held_out.density(there) - held_out.density(lost.set)
    channels = [c for _, g in standing.members for c in _channels(g)]
    rows = int(explanation.rows.used[:, np.unique(channels)].sum())
    return float(1 - np.exp(-rise / rows))


def _channels(group: Group) -> tuple[int, ...]:
    """Outputs that something random scatters: its own, or those that feel angles."""
    effect = group.effect
    of_outputs = effect is not None and len(effect.params) == len(CHANNELS)
    return group.params if of_outputs else (0, 1, 2)


def gain(explanation: Explanation, lost: Removed, then: Agreement) -> float:
    """Part of the held-out rms that goes, in the channel where the effect is most."""
    best, turned = explanation.best, explanation.inferred.turned
    there = Fitted(best.rows, best.dictionary, best.linear, best.values, lost.set)
    if in_turns(lost):
        without = rms_of(turns_held_out(there, turned))
        return float(1 - rms_of(explanation.turns_held_out) / without)
    ahead = rms(best.rows, explanation.held_out.residual([lost.set]))
    now = then.held_out
    share = np.where(np.isfinite(now) & (ahead > 0), lost.squares, -1.0)
    c = int(np.argmax(share))
    return float(1 - now[c] / ahead[c]) if share[c] > 0 else np.nan


def of_tone(tone: Tone, gained: float) -> FoundEffect:
    """A line in the spectrum."""
    values = {
        n: Quantity(v, tone.sigmas[n], tone.effect.unit(n))
        for n, v in tone.values.items()
    }
    evidence = {"delta_chi2": tone.chi2, "held_out_gain": gained}
    return FoundEffect(tone.effect.id, values, evidence=evidence)


def of_samples(faults: Sequence[tuple[str, Fault]]) -> Iterator[FoundEffect]:
    """Effects on samples; steps of both triads are one."""
    steps: dict[str, Quantity] = {}
    for name, fault in faults:
        if not fault.values:
            continue
        effect = catalogue()[name]
        units = {p.name: p.unit for p in effect.params}
        units |= {s.name: s.unit for s in effect.shapes}
        values = {
            n: Quantity(v, fault.sigmas.get(n), _unit(n, fault, units))
            for n, v in fault.values.items()
        }
        if name == "quantisation":
            steps |= values
            continue
        yield FoundEffect(name, values, evidence={"delta_chi2": fault.sigma**2})
    if steps:
        yield FoundEffect("quantisation", steps)


def _unit(name: str, fault: Fault, units: dict[str, str]) -> str:
    if name == "limit":
        return "m/s^2" if fault.channel in CHANNELS[:3] else "rad/s"
    if name == "needed_s":  # of a window
        return "s"
    return units.get(name, "1")
