"""Makes the diagnosis of a recording: verdict, effects, numbers and sentences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from fieldcal.calibration.parameters import Nominal
from fieldcal.calibration.plausible import implausible_values, misdirected_turns
from fieldcal.core.samples import CHANNELS, GYR, Block
from fieldcal.diagnosis.explain import Explanation, explain
from fieldcal.diagnosis.findings import found_effects, mismatches, sample_effects
from fieldcal.diagnosis.findings.agreement import UNITS, ModelResiduals
from fieldcal.diagnosis.findings.calibrated import (
    calibration_groups,
    calibration_of_set,
    exhausted_search,
    impossible_turn_scales,
)
from fieldcal.diagnosis.findings.candidates import tried_candidates
from fieldcal.diagnosis.findings.curves import residual_curves
from fieldcal.diagnosis.findings.filters import found_filters
from fieldcal.diagnosis.findings.found_effects import CauseRemoval
from fieldcal.diagnosis.findings.limitations import limitations, undetermined_parameters
from fieldcal.diagnosis.findings.quality import (
    TURN_UNIT,
    explained_residuals,
    most_different_triad,
    simulation_residuals,
    turn_quality,
)
from fieldcal.diagnosis.findings.unknown_mismatch import (
    UnknownMismatch,
    list_positions,
    unknown_mismatches,
)
from fieldcal.diagnosis.prepare import prepare_recording
from fieldcal.diagnosis.result import Diagnosis, FoundEffect, Mismatch, Quality, Verdict
from fieldcal.diagnosis.wording.advice import advice
from fieldcal.diagnosis.wording.lines import by_impact, effect_lines
from fieldcal.diagnosis.wording.paragraph import notes, paragraph
from fieldcal.effects import catalogue
from fieldcal.model import thresholds
from fieldcal.model.posterior.probabilities import ProbableCause
from fieldcal.model.rows.window_bounds import window_bounds
from fieldcal.session.description import Description


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
    return make_diagnosis(block, explain(prepare_recording(block, about)))


def make_diagnosis(block: Block, explanation: Explanation) -> Diagnosis:
    """Make the diagnosis from an explanation of the samples of a block."""
    standing = explanation.probable_causes
    lost = {s.name: found_effects.remove_cause(explanation, s) for s in standing}
    first = simulation_residuals(block, explanation)
    then = explained_residuals(explanation)
    effects = _effects(explanation, lost, then)
    strange = _without_effect(explanation, lost)
    odd = _impossible_facts(explanation)
    verdict = _verdict(explanation, effects, strange, odd)
    # positions are counted as held up to here, and as listed in session.toml from here
    indices_in_file = explanation.source.about.indices_in_file

    def counted(one: Mismatch) -> Mismatch:
        return replace(one, positions=tuple(sorted(indices_in_file(one.positions))))

    mismatch = tuple(
        counted(m) for m in _all_mismatches(block, explanation, lost, strange)
    )
    strange = [
        replace(u, mismatch=counted(u.mismatch), exchanged=indices_in_file(u.exchanged))
        for u in strange
    ]
    quality = _quality(explanation, lost, first, then)
    words = paragraph(
        verdict, effects, mismatch, strange, quality,
        notes(explanation, undetermined_parameters(explanation)), odd,
    )  # fmt: skip
    return Diagnosis(
        verdict=verdict, probability=_probability(explanation, verdict),
        mismatch=mismatch, effects=tuple(effects), unit=quality[2], before=quality[0],
        after=quality[1], calibration=calibration_groups(explanation),
        warnings=(*odd, *limitations(explanation)), says=words,
        candidates=tried_candidates(explanation, effects),
        curves=tuple(residual_curves(explanation, mismatch, first, then)),
        next=tuple(advice(explanation, by_impact(effects), strange, mismatch, odd)),
        lines=effect_lines(by_impact(effects)),
    )  # fmt: skip


def _quality(
    explanation: Explanation,
    lost: Mapping[str, CauseRemoval],
    first: ModelResiduals,
    then: ModelResiduals,
) -> tuple[Quality, Quality, str]:
    """Quality before and after, and its unit.

    Of the windows, or of the turns if all causes show in the turns alone.
    """
    prepared = explanation.prepared
    of_samples = prepared.spectral_lines or prepared.checked.ids
    if (
        lost
        and not of_samples
        and all(map(found_effects.shows_mainly_in_turns, lost.values()))
    ):
        if explanation.inferred.turn_rows:
            return *turn_quality(explanation), TURN_UNIT
    triad = most_different_triad(first, then)
    return first.quality(triad), then.quality(triad), UNITS[triad]


def _effects(
    explanation: Explanation, lost: Mapping[str, CauseRemoval], then: ModelResiduals
) -> list[FoundEffect]:
    prepared = explanation.prepared
    effects = list(sample_effects.effects_of_faults(prepared.checked.faults))
    for tone, left in zip(
        prepared.spectral_lines, prepared.line_remainders, strict=True
    ):
        effects.append(
            sample_effects.effect_of_line(tone, left.gain(tone.clear_channels))
        )
    for cause in explanation.probable_causes:
        if cause.name in catalogue():
            removal = lost[cause.name]
            found = found_effects.effect_of_cause(explanation, cause, removal, then)
            effects.append(found)
    effects += found_filters(explanation)
    if explanation.each_window_shows_earth_rate:
        evidence = {"delta_chi2": 2 * explanation.earth_rate_evidence}
        effects.append(FoundEffect("earth_rate", {}, evidence=evidence))
    return effects


def _without_effect(
    explanation: Explanation, lost: Mapping[str, CauseRemoval]
) -> list[UnknownMismatch]:
    """Mismatches of causes that are not effects of the catalogue."""
    out = []
    for cause in explanation.probable_causes:
        if cause.name not in catalogue():
            places = list(mismatches.of_unknown(explanation, cause, lost[cause.name]))
            out += unknown_mismatches(explanation, cause, places)
    return out


def _verdict(
    explanation: Explanation,
    effects: Sequence[FoundEffect],
    strange: Sequence[UnknownMismatch],
    odd: Sequence[str],
) -> Verdict:
    if strange or odd:
        return "unexplained"
    if any(_is_open(explanation, cause) for cause in explanation.probable_causes):
        return "ambiguous"
    if effects:
        return "left_out"
    return "ambiguous" if explanation.undecided else "consistent"


def _impossible_facts(explanation: Explanation) -> list[str]:
    """Sentences about values that no sensor has, and turns that end elsewhere.

    Either means that the description of the recording is wrong.
    """
    calibration = calibration_of_set(explanation, explanation.best.set)
    nominal = explanation.source.about.nominal
    values = implausible_values(
        tuple(calibration),
        np.array([value for value, _, _ in calibration.values()]),
        np.array([sigma for _, sigma, _ in calibration.values()]),
        Nominal(**{k: tuple(v.tolist()) for k, v in nominal.items()}),
    )
    values += impossible_turn_scales(explanation).values()
    if sentence := exhausted_search(explanation):
        values.append(sentence)
    return values + misdirected_turns(_unexplained_turns(explanation))


def _unexplained_turns(explanation: Explanation) -> list[tuple[str, str]]:
    """Turns whose end contradicts the next position, as pairs of position names.

    Turns during which faults of samples were found are left out.
    """
    source, faults = explanation.source, explanation.prepared.checked.faults
    t, windows = source.block.t, window_bounds(source.block, source.about)
    wrong = [f for _, f in faults if {f.channel, *f.channels} & {"t", *CHANNELS[GYR]}]
    out = []
    for p, q in explanation.inferred.contradicted_turns:
        leaves, arrives = t[windows[p, 1] - 1], t[windows[q, 0]]
        if not any(f.from_s <= arrives and f.to_s >= leaves for f in wrong):
            before, behind = source.about.indices_in_file((p, q))
            out.append((list_positions([before]), list_positions([behind])))
    return out


def _is_open(explanation: Explanation, cause: ProbableCause) -> bool:
    """Whether an alias, or bias and scale factor, may explain what a cause does."""
    if cause.name in catalogue() and catalogue()[cause.name].like_calibration:
        return True
    others = explanation.posterior.probability(cause.aliases, cause.triads)
    return others > thresholds.MENTIONED


def _probability(explanation: Explanation, verdict: Verdict) -> float:
    """Probability that the verdict is right.

    That is: all reported causes are present; or none is; or, where none can be named,
    at least one is.
    """
    posterior = explanation.posterior
    if verdict == "consistent":
        return posterior.probability_of_noise_alone
    if verdict == "ambiguous" and explanation.undecided:
        return 1 - posterior.probability_of_noise_alone
    wanted = [
        {cause.name, *cause.aliases_of_kind} for cause in explanation.probable_causes
    ]
    return sum(
        w
        for s, w in posterior.weights
        if all(names & set(posterior.cause_names(s)) for names in wanted)
    )


def _all_mismatches(
    block: Block,
    explanation: Explanation,
    lost: Mapping[str, CauseRemoval],
    strange: Sequence[UnknownMismatch],
) -> list[Mismatch]:
    prepared = explanation.prepared
    windows = window_bounds(block, prepared.source.about)
    out = list(mismatches.of_faults(block.t, windows, prepared.checked.faults))
    out += mismatches.of_tones(explanation)
    for cause in explanation.probable_causes:
        if cause.name in catalogue():
            out += mismatches.of_cause(explanation, cause, lost[cause.name])
    out += [u.mismatch for u in strange]
    return sorted(out, key=lambda m: -m.sigma)
