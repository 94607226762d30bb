"""Effects that a recording shows and a calibration does not contain.

`solve` fits bias, scale factor and the requested parameters. The same windows may
contain other effects: a bias that drifts, a wrong angle of a joint, a wrongly decoded
byte. The diagnosis states which effects are present. For those that the calibration
does not contain, the shift of each parameter k is

    shift_k = (value with all effects - value without the omitted ones) / sigma_k

Both values come from the same model and rows, so that the shift does not depend on
conventions of axes and signs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.calibration.names import TILTS
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.findings.calibrated import (
    calibration_of_set,
    exhausted_search,
    impossible_turn_scales,
)
from fieldcal.diagnosis.findings.unknown_mismatch import (
    angle_errors,
    exchanged_positions,
    list_positions,
)
from fieldcal.diagnosis.prepare import PreparedRecording
from fieldcal.diagnosis.wording.paragraph import angle_errors_text, exchange_text
from fieldcal.effects import catalogue
from fieldcal.model import thresholds
from fieldcal.model.posterior.probabilities import ProbableCause
from fieldcal.physics.effect import Chain, Scatter


@dataclass(frozen=True, slots=True)
class OmittedEffects:
    """Effects that a recording shows and its calibration does not contain.

    Attributes
    ----------
    causes : probability by id of the effect
    shift_sigmas : by how many sigmas they move each parameter
    described : cause in words by its id, for ids that are not in the catalogue

    """

    causes: Mapping[str, float]
    shift_sigmas: Mapping[str, float]
    described: Mapping[str, str] = field(default_factory=dict)

    @property
    def largest_shift(self) -> tuple[str, float]:
        """The parameter with the largest shift, and the shift in sigmas."""
        name = max(
            self.shift_sigmas, key=lambda n: abs(self.shift_sigmas[n]), default=""
        )
        return name, self.shift_sigmas.get(name, 0.0)


def omitted_effects(
    explanation: Explanation, calibration: Calibration
) -> OmittedEffects:
    """Effects that a recording shows and its calibration does not contain."""
    out = [s for s in explanation.probable_causes if not _is_included(calibration, s)]
    if not out:
        return OmittedEffects({}, {})
    return OmittedEffects(
        {s.name: s.probability for s in out},
        _shift_sigmas(explanation, out),
        {
            s.name: _describe_wrong_angles(explanation, s)
            for s in out
            if s.kind == "position"
        },
    )


def wrong_angle_sentences(explanation: Explanation) -> list[str]:
    """Sentences about wrong angles, in one position or wherever they are set."""
    out = []
    for s in explanation.probable_causes:
        if s.kind == "position":
            cure = "set it again and repeat it, and this is known better"
            if any(group.moved_positions for _, group in s.members):
                cure = "mend it before the next recording"
            elif exchanged_positions(explanation, s):
                cure = "exchange them in session.toml, and this is known better"
            out.append(
                f"the recording shows {_describe_wrong_angles(explanation, s)}: the"
                f" result is for the angle that was found; {cure}"
            )
    return out


def _describe_wrong_angles(explanation: Explanation, cause: ProbableCause) -> str:
    """Wrong angles in words, with their positions and sizes."""
    in_file = explanation.prepared.source.about.indices_in_file
    pairs = exchanged_positions(explanation, cause)
    exchanged = {p for pair in pairs for p in pair}
    phrases = [f"that {exchange_text(in_file(pair))}" for pair in pairs]
    for positions, angles in angle_errors(explanation, cause).items():
        where = list_positions(in_file(positions))
        if exchanged.isdisjoint(positions):
            what = f", as {angle_errors_text(angles)}" if angles else ""
            phrases.append(f"a wrong angle{what} in {where}")
    return " and ".join(phrases)


def _is_included(calibration: Calibration, standing: ProbableCause) -> bool:
    """Whether a cause is in the calibration, is random, or is not an effect.

    A wrong angle is not an effect. The fit may attribute it to cross-coupling within
    the grade, and then no position is left out.
    """
    with_it = calibration.info.get("carried", {}).get("causes", {})
    if any(cause.kind == "position" for cause, _ in standing.members):
        return standing.name in with_it
    effect = catalogue().get(standing.name)
    if effect is None or isinstance(effect, Scatter):
        return True
    carrying = {standing.name, *standing.aliases, effect.carried_by}
    if standing.name in TILTS and "beside_tilt_sigma_deg" in calibration.info:
        carrying |= {*TILTS}  # both kinds of tilt are included then
    return bool(carrying & {*calibration.groups, *with_it})


def _shift_sigmas(
    explanation: Explanation, out: Sequence[ProbableCause]
) -> dict[str, float]:
    """Shift of each parameter by some causes, in sigmas, by full name."""
    names = {s.name for s in out}
    best = explanation.posterior.best
    kept = tuple(m for m in best.members if m[0].name not in names)
    reduced = explanation.posterior.sets.reduced(best, kept)
    full, without = (calibration_of_set(explanation, s) for s in (best, reduced))
    return {
        name: float((full[name][0] - without[name][0]) / without[name][1])
        for name in full
        if name in without and without[name][1] > 0 and np.isfinite(full[name][0])
    }


def with_description_faults(
    prepared: PreparedRecording, calibration: Calibration
) -> Calibration:
    """The calibration, marked as bad if session.toml is found to be wrong.

    Its `info` names what about: no further position makes it right.
    """
    sentences, wrong = [], []
    for name, fault in prepared.checked.faults:
        effect = catalogue()[name]
        if isinstance(effect, Chain) and effect.misread:
            wrong.append(name)
            values = ", ".join(f"{k} = {v}" for k, v in fault.values.items())
            mended = fault.mended is not None
            mend = "mend it and solve again"
            if "unit" in fault.values:  # the samples are SI: no file states it
                sensor = "gyr" if fault.channel.startswith("g") else "acc"
                mend = (
                    f"import it again with --{sensor}-unit, or record it again with"
                    f" {sensor}_unit in the device's address, and solve again"
                )
            sentences.append(
                f"session.toml is wrong about the {name} ({values}): {mend};"
                " the numbers are those of"
                f" {'samples that were put right' if mended else 'what it states'}"
            )
    if not sentences:
        return calibration
    warnings = (*sentences, *calibration.warnings)
    info = {**calibration.info, "misdescribed": wrong}
    return replace(calibration, warnings=warnings, info=info, good=False)


def with_impossible_explanation(
    explanation: Explanation, calibration: Calibration
) -> Calibration:
    """The calibration, marked as bad if what explains it best allows none.

    Nothing explains it, a scale factor has an impossible value, or an effect is shown
    behind which nothing can be calibrated. Scale factors that it states itself are
    judged by their own values.
    """
    own = {*calibration.names}
    sentences = [
        "what explains the recording best is impossible, so that something else"
        " happened in it; fieldcal diagnose says where it parts; take the positions"
        f" again: {sentence}"
        for name, sentence in impossible_turn_scales(explanation).items()
        if name not in own
    ]
    if unexplained := exhausted_search(explanation):
        sentences.append(f"the recording shows so much that {unexplained}")
    sentences += _ruining_effects(explanation)
    if not sentences:
        return calibration
    warnings = (*sentences, *calibration.warnings)
    return replace(calibration, warnings=warnings, good=False)


def _ruining_effects(explanation: Explanation) -> list[str]:
    """Sentences on effects, likely by themselves, that allow no calibration."""
    named = {cause.name for cause in explanation.probable_causes} & {*catalogue()}
    ruining = {name: why for name in named if (why := catalogue()[name].ruins)}
    chances = {name: explanation.posterior.probability([name]) for name in ruining}
    return [
        f"the recording shows {name} (probability {p:.2f}): {ruining[name]}"
        for name, p in sorted(chances.items())
        if p >= thresholds.NAMED
    ]


def with_omitted_effects(
    calibration: Calibration, missing: OmittedEffects
) -> Calibration:
    """The calibration with a warning about effects that it does not contain."""
    if not missing.causes:
        return calibration
    name, sigmas = missing.largest_shift
    shown = " and ".join(
        f"{missing.described.get(id_, id_)} (probability {p:.2f})"
        for id_, p in missing.causes.items()
    )
    info = {"causes": dict(missing.causes), "moved_sigmas": dict(missing.shift_sigmas)}
    found = replace(calibration, info={**calibration.info, "not_carried": info})
    if abs(sigmas) < thresholds.MOVED:
        return found
    sentence = (
        f"the recording shows {shown}, which this result does not contain: with it"
        f" {name} would move by {sigmas:+.1f} σ; fieldcal diagnose says what it is and"
        " what to do"
    )
    good = calibration.good and abs(sigmas) < thresholds.MOVED_WRONG
    return replace(found, warnings=(sentence, *calibration.warnings), good=good)
