"""From what was found to a diagnosis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fieldcal.description import Description
from fieldcal.diagnosis import locate, naming
from fieldcal.diagnosis.advice import advice
from fieldcal.diagnosis.aliases import Aliases, aliases
from fieldcal.diagnosis.common import common_scale
from fieldcal.diagnosis.curves import curves
from fieldcal.diagnosis.explain import Explanation, explain
from fieldcal.diagnosis.fit import Fit
from fieldcal.diagnosis.league import league
from fieldcal.diagnosis.naming import Removed
from fieldcal.diagnosis.prepare import prepare
from fieldcal.diagnosis.quality import UNITS, Agreement, after, before, parted
from fieldcal.diagnosis.reduce import spans
from fieldcal.diagnosis.result import (
    Diagnosis,
    Found,
    Group,
    Mismatch,
    Quality,
    Quantity,
    Verdict,
)
from fieldcal.diagnosis.unknown import Unknown, matters, unknowns
from fieldcal.diagnosis.words import notes, paragraph
from fieldcal.samples import Block

GROUPS = ("acc_bias", "acc_scale", "gyr_bias", "gyr_scale")
GROUP_UNITS = ("m/s^2", "1", "rad/s", "1")

ABSURD = (1.0, 0.1, 0.1, 0.1)
"""Sigma from which a parameter of a group counts as not determined."""


def diagnose(block: Block, about: Description) -> Diagnosis:
    """Say what physics the simulation leaves out of a recording.

    Parameters
    ----------
    block : all samples, SI
    about : what session.toml says

    Raises
    ------
    InputError
        If nothing in the recording can be used.

    """
    return concluded(block, explain(prepare(block, about)))


def concluded(block: Block, explanation: Explanation) -> Diagnosis:
    """What follows from an explanation of the samples of a block."""
    lost = {t.effect.id: naming.removed(explanation, t) for t in explanation.terms}
    first = before(block, explanation.as_said)
    then = after(explanation)
    unknown = _unknown(explanation, first, then)
    others = aliases(explanation)
    effects = _effects(explanation, lost, then, others)
    verdict = _verdict(effects, unknown, others)
    # so far positions were counted as they were held, from here on as they are listed
    numbered = explanation.prepared.source.about.numbered
    mismatch = tuple(
        replace(m, positions=tuple(sorted(numbered(m.positions))))
        for m in _mismatch(block, explanation, lost, unknown)
    )
    unknown = [
        replace(u, positions=tuple(sorted(numbered(u.positions)))) for u in unknown
    ]
    quality = _quality(explanation, first, then)
    words = paragraph(
        verdict,
        effects,
        mismatch,
        unknown,
        quality,
        explanation,
        notes(explanation, explanation.left),
    )
    return Diagnosis(
        verdict=verdict,
        mismatch=mismatch,
        effects=tuple(effects),
        unit=quality[2],
        before=quality[0],
        after=quality[1],
        calibration=_calibration(explanation),
        warnings=_warnings(explanation),
        says=words,
        candidates=league(explanation, effects),
        curves=tuple(curves(explanation, mismatch, first, then)),
        next=tuple(advice(explanation, effects, unknown)),
    )


def _unknown(
    explanation: Explanation, first: Agreement, then: Agreement
) -> list[Unknown]:
    found = unknowns(explanation)
    explained = first.fit.chi2 - explanation.fit.chi2
    return found if matters(found, explained) or not explanation.terms else []


def _effects(
    explanation: Explanation,
    lost: dict[str, Removed],
    then: Agreement,
    others: Aliases,
) -> list[Found]:
    prepared = explanation.prepared
    found = list(naming.of_samples(prepared.checked.faults))
    for tone, left in zip(prepared.tones, prepared.remains, strict=True):
        values = {
            n: Quantity(v, tone.sigmas[n], tone.effect.unit(n))
            for n, v in tone.values.items()
        }
        evidence = {"delta_chi2": tone.chi2, "held_out_gain": left.gain(tone.clear)}
        found.append(Found(tone.effect.id, values, evidence=evidence))
    found += naming.of_windows(explanation, lost, then, others.ids)
    found += naming.of_chance(explanation, others.ids)
    found += naming.of_turns(explanation, others.ids)
    if explanation.sees_earth:
        evidence = {"delta_chi2": 2 * explanation.earth}
        found.append(Found("earth_rate", {}, evidence=evidence))
    if (gravity := common_scale(explanation)) is not None:
        found.append(gravity)
    return found


def _verdict(
    effects: Sequence[Found], unknown: Sequence[Unknown], others: Aliases
) -> Verdict:
    if unknown:
        return "unexplained"
    if any(f.id == "gravity_error" or f.id in others.open for f in effects):
        return "ambiguous"
    return "left_out" if effects else "consistent"


def _mismatch(
    block: Block,
    explanation: Explanation,
    lost: dict[str, Removed],
    unknown: Sequence[Unknown],
) -> list[Mismatch]:
    prepared = explanation.prepared
    about = prepared.source.about
    windows = spans(block, about)
    out = list(locate.of_faults(block.t, windows, prepared.checked.faults))
    out += locate.of_tones(explanation)
    out += locate.of_effects(explanation, lost)
    out += locate.of_chance(explanation)
    out += locate.of_turns(explanation)
    out += locate.of_unknown(explanation, unknown)
    return sorted(out, key=lambda m: -m.sigma)


def _quality(
    explanation: Explanation, first: Agreement, then: Agreement
) -> tuple[Quality, Quality, str]:
    """Before, after and the unit: of the windows, or of the turns if only they part."""
    turning, table = explanation.turning, explanation.table
    prepared = explanation.prepared
    seen = bool(explanation.terms or prepared.tones or prepared.checked.ids)
    seen = seen or bool(explanation.model.random)
    if turning is not None and table is not None and turning.terms and not seen:
        plain = table.fit((), turning.rows)
        one = Quality(
            float(np.sqrt(plain.chi2 / max(turning.rows.sum(), 1))),
            plain.chi2 / max(plain.dof, 1),
            table.left_out((), turning.rows),
        )
        other = Quality(
            float(np.sqrt(turning.chi2 / max(turning.rows.sum(), 1))),
            turning.chi2 / max(turning.dof, 1),
            table.left_out(turning.terms, turning.rows),
        )
        return one, other, "standard deviations, in turns"
    triad = parted(first, then)
    return first.quality(triad), then.quality(triad), UNITS[triad]


def _calibration(explanation: Explanation) -> dict[str, Group]:
    fit: Fit = explanation.fit
    about = explanation.prepared.source.about
    nominal, gauge = about.nominal, about.gauge
    out = {}
    for group, unit, absurd in zip(GROUPS, GROUP_UNITS, ABSURD, strict=True):
        value, sigma = np.full(3, np.nan), np.full(3, np.nan)
        for i, axis in enumerate("xyz"):
            if (name := f"{group}.{axis}") in fit.names:
                at = fit.names.index(name)
                if fit.determined[at] and fit.sigma[at] < absurd * _size(fit, group, i):
                    value[i], sigma[i] = fit.values[at], fit.sigma[at]
        if np.isfinite(value).any():
            change = value - nominal[group]
            size, unit = gauge.of(group) or (1.0, unit)
            found = [tuple((size * part).tolist()) for part in (value, sigma, change)]
            out[group] = Group(found[0], found[1], found[2], unit)
    return out


def _size(fit: Fit, group: str, axis: int) -> float:
    scale = fit.state.scale[axis + 3 * group.startswith("gyr")]
    return float(abs(scale)) or 1.0


def _warnings(explanation: Explanation) -> tuple[str, ...]:
    bench, fit = explanation.prepared.bench, explanation.fit
    out = []
    parameters = sum(n.startswith(("acc", "gyr")) for n in fit.names)
    triads = [("accelerometers", 0), ("gyroscopes", 3)]
    for name, first in triads:
        if bench.rows.used[:, first : first + 3].any():
            spare = _spare(explanation, first)
            if spare <= 1:
                out.append(
                    f"{max(spare, 0)} degrees of freedom in the means of the {name}:"
                    " their residual says nothing about the fit; take more positions"
                )
    open_ = [
        n
        for n, d in zip(fit.names, fit.determined, strict=True)
        if not d and not n.startswith("aside")
    ]
    if open_ and parameters:
        out.append(f"not determined by these positions: {', '.join(open_)}")
    return tuple(out)


def _spare(explanation: Explanation, first: int) -> int:
    """Means of windows less parameters, for one triad."""
    bench, fit = explanation.prepared.bench, explanation.fit
    part = slice(first, first + 3)
    held = [
        bench.rows.used[bench.rows.x.position == p][:, part].any(axis=0).sum()
        for p in np.unique(bench.rows.x.position)
    ]
    columns = np.abs(fit.design[:, part]).max(axis=(0, 1)) > 0
    return int(sum(held) - (columns & fit.determined).sum())
