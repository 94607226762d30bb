"""The effects that were found, with numbers, evidence and aliases."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.diagnosis.dwell import ARRIVAL_S
from fieldcal.diagnosis.estimate import RELAX, sigmas
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.fit import Fit
from fieldcal.diagnosis.heldout import held_out, rms
from fieldcal.diagnosis.model import Term
from fieldcal.diagnosis.quality import Agreement
from fieldcal.diagnosis.result import Found, Quantity
from fieldcal.diagnosis.scatter import dropped, size_sigma, wanders
from fieldcal.diagnosis.steps import jump_instant
from fieldcal.diagnosis.unknown import walking
from fieldcal.effects import Fault, catalogue
from fieldcal.samples import CHANNELS, Array

MATERIAL = 44.0
"""Twice the rise of ln L from which what wanders is said: less only widens."""


@dataclass(frozen=True, slots=True)
class Removed:
    """What is lost when one effect is taken out of the windows' model.

    Attributes
    ----------
    fit : without it
    squares : (6,) by how much the whitened squares of each channel rise
    held_out : (6,) held-out rms without it

    """

    fit: Fit
    squares: Array
    held_out: Array


def removed(explanation: Explanation, term: Term) -> Removed:
    """Fit and predict without one effect."""
    bench = explanation.wide
    rest = [t for t in explanation.fit.terms if t.effect.id != term.effect.id]
    fit = bench.fit(rest, explanation.fit)
    squares = (fit.white**2).sum(axis=0) - (explanation.fit.white**2).sum(axis=0)
    return Removed(fit, squares, rms(bench.rows, held_out(bench, rest, fit)))


def of_windows(
    explanation: Explanation,
    lost: Mapping[str, Removed],
    then: Agreement,
    aliases: Mapping[str, Sequence[str]],
) -> Iterator[Found]:
    """Effects with an equation that the windows show."""
    for term in explanation.terms:
        name = term.effect.id
        without = lost[name]
        parameters = {
            n: Quantity(v, s, term.effect.unit(n))
            for n, (v, s) in sigmas(explanation.fit, term).items()
        }
        if name == "settling":
            parameters = _since_arrival(parameters)
        if "at_s" in term.shape:
            at, error = jump_instant(
                explanation.prepared.source,
                explanation.wide,
                without.fit,
                explanation.fit,
                term,
            )
            parameters["at_s"] = Quantity(at, error, "s")
        delta = without.fit.chi2 - explanation.fit.chi2
        count = len(term.names) + ("at_s" in term.shape)
        used = int(explanation.prepared.bench.rows.used.sum())
        evidence = {
            "delta_chi2": delta,
            "delta_bic": delta - count * float(np.log(used)),
            "held_out_gain": gain(without, then.held_out),
        }
        yield Found(name, parameters, tuple(aliases.get(name, ())), evidence)


def _since_arrival(found: dict[str, Quantity]) -> dict[str, Quantity]:
    """Amplitudes with the uncertainty of the instant that they are counted from."""
    tau = found["tau_s"].value if "tau_s" in found else np.inf
    out = dict(found)
    for name in (n for n in found if n in CHANNELS):
        value, sigma, unit = found[name].value, found[name].sigma, found[name].unit
        if not isinstance(value, str) and not isinstance(tau, str):
            unsure = abs(value) * ARRIVAL_S / max(tau, ARRIVAL_S)
            out[name] = Quantity(value, float(np.hypot(sigma or 0.0, unsure)), unit)
    return out


def gain(without: Removed, now: Array) -> float:
    """Part of the held-out rms that goes, in the channel where the effect is most."""
    share = np.where(np.isfinite(now) & (without.held_out > 0), without.squares, -1.0)
    c = int(np.argmax(share))
    if share[c] <= 0:
        return np.nan
    return float(1 - now[c] / without.held_out[c])


def of_chance(
    explanation: Explanation, aliases: Mapping[str, Sequence[str]]
) -> Iterator[Found]:
    """Random effects: what wanders, and angles set by hand."""
    bench, model = explanation.model.bench, explanation.model
    plain = explanation.prepared.bench
    if bench.errors.setting > 0:
        sigma = size_sigma(plain, explanation.fit, "setting", 0, bench.errors.setting)
        yield Found(
            "angle_setting",
            {
                "sigma_deg": Quantity(
                    float(np.rad2deg(bench.errors.setting)),
                    float(np.rad2deg(sigma)),
                    "deg",
                )
            },
            tuple(aliases.get("angle_setting", ())),
            _rise(explanation, "setting"),
        )
    walks = walking(explanation)
    names = [n for n in model.random if n.startswith(("walk", "offset"))]
    rise = _rise(explanation, *names) if walks else {}
    if walks and rise["delta_chi2"] > MATERIAL:
        unit = catalogue()["random_walk"].unit
        found = {}
        for part in walks:
            name = CHANNELS[part.channel]
            size = part.size
            if part.kind == "offset":  # over the time from one window to the next
                size /= float(np.sqrt(np.ptp(plain.rows.x.t) / plain.windows))
            sigma = size_sigma(plain, explanation.fit, "walk", part.channel, size)
            found[name] = Quantity(size, sigma, unit(name))
        others = tuple(aliases.get("random_walk", ()))
        yield Found("random_walk", found, others, rise)


def _rise(explanation: Explanation, *names: str) -> dict[str, float]:
    total = 0.0
    for name in names:
        bench = explanation.model.bench
        bench = bench.but(errors=dropped(bench.errors, name), relax=RELAX)
        without = bench.fit(explanation.fit.terms, explanation.fit)
        gains = {w.name: w.gain for w in wanders(bench, without)}
        total += 2 * gains.get(name, 0.0)
    return {"delta_chi2": total, "delta_bic": total, "held_out_gain": np.nan}


def of_turns(
    explanation: Explanation, aliases: Mapping[str, Sequence[str]]
) -> Iterator[Found]:
    """Effects that the turns show."""
    turning, table = explanation.turning, explanation.table
    if turning is None or table is None:
        return
    error = np.sqrt(np.diag(turning.covariance))
    for term in turning.terms:
        name = term.effect.id
        kept = tuple(t for t in turning.terms if t is not term)
        less = table.fit(kept, turning.rows, RELAX)
        now = table.fit(turning.terms, turning.rows, RELAX)
        found = {}
        for n in term.names:
            at = turning.names.index(f"{name}.{n}")
            if turning.determined[at]:
                found[n] = Quantity(
                    float(turning.values[at]), float(error[at]), term.effect.unit(n)
                )
        delta = less.chi2 - now.chi2
        ahead = table.left_out(turning.terms, turning.rows)
        alone = table.left_out(kept, turning.rows)
        evidence = {
            "delta_chi2": delta,
            "delta_bic": delta - len(term.names) * float(np.log(turning.rows.sum())),
            "held_out_gain": 1 - ahead / alone,
        }
        yield Found(name, found, tuple(aliases.get(name, ())), evidence)


def of_samples(faults: Sequence[tuple[str, Fault]]) -> Iterator[Found]:
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
        yield Found(name, values, evidence={"delta_chi2": fault.sigma**2})
    if steps:
        yield Found("quantisation", steps)


def _unit(name: str, fault: Fault, units: Mapping[str, str]) -> str:
    if name == "limit":
        return "m/s^2" if fault.channel.startswith("a") else "rad/s"
    return units.get(name, "1")
