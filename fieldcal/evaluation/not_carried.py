"""What a recording shows and a calibration does not carry.

The estimators of `solve` fit bias, scale factor and what they are told to; a bias that
drifted, a joint that was read wrongly or a byte that was decoded wrongly is in their
windows all the same. Here the one model of the diagnosis says what is there, what of it
the calibration has not in it, and by how much each of its parameters moves with it:

    moved_k = (value with all that is there - value without what is missing) / sigma_k

Both values are the model's own, of the same rows, so that conventions do not count.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.calibration.names import TILTS
from fieldcal.core.samples import CHANNELS
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.findings.calibrated import calibration_of_set
from fieldcal.diagnosis.findings.unknown_mismatch import angle_errors, list_positions
from fieldcal.diagnosis.prepare import PreparedRecording
from fieldcal.diagnosis.signal.chain import find_in_recorded_samples
from fieldcal.diagnosis.wording.paragraph import angle_errors_text
from fieldcal.effects import catalogue
from fieldcal.model import thresholds
from fieldcal.model.evidence.sets import Set
from fieldcal.model.posterior.probabilities import Standing
from fieldcal.physics.effect import Chain, Scatter
from fieldcal.session.folder import Session

BYTES = "decode_fault"


@dataclass(frozen=True, slots=True)
class Uncarried:
    """What a calibration does not carry.

    Attributes
    ----------
    causes : probability by id of the effect
    moved : by how many sigmas each parameter moves with them
    described : a cause in words, by its id, where the id is none of the catalogue

    """

    causes: Mapping[str, float]
    moved: Mapping[str, float]
    described: Mapping[str, str] = field(default_factory=dict)

    @property
    def most(self) -> tuple[str, float]:
        """The parameter that moves most, and by how many sigmas."""
        name = max(self.moved, key=lambda n: abs(self.moved[n]), default="")
        return name, self.moved.get(name, 0.0)


def mended(session: Session) -> tuple[Session, tuple[str, ...]]:
    """The session with bytes put right that were decoded wrongly, and what was done."""
    if not session.positions:
        return session, ()
    found = find_in_recorded_samples(BYTES, session.block, session.about)
    faults = [fault for fault in found if fault.mended is not None]
    if not faults:
        return session, ()
    six, sentences = session.block.six, []
    for fault in faults:
        if fault.mended is None:
            continue
        c = CHANNELS.index(fault.channel)
        six[:, c] = fault.mended[:, c]
        sentences.append(
            f"{fault.channel}: bytes were decoded wrongly"
            f" ({fault.values.get('kind', 'unknown')}) and are put right here; mend the"
            " driver that wrote them"
        )
    right = replace(session, warnings=())
    right.__dict__["block"] = replace(session.block, acc=six[:, :3], gyr=six[:, 3:])
    return right, tuple(sentences)


def uncarried(explanation: Explanation, calibration: Calibration) -> Uncarried:
    """What a recording shows that a calibration of it does not carry."""
    out = [s for s in explanation.probable_causes if not _carries(calibration, s)]
    if not out:
        return Uncarried({}, {})
    return Uncarried(
        {s.name: s.probability for s in out},
        _moved(explanation, out),
        {s.name: _wrong_angles(explanation, s) for s in out if s.kind == "position"},
    )


def wrong_angles(explanation: Explanation) -> list[str]:
    """Sentences about angles that were wrong, in one position or wherever set."""
    out = []
    for s in explanation.probable_causes:
        if s.kind == "position":
            cure = (
                "mend it before the next recording"
                if any(group.together for _, group in s.members)
                else "set it again and repeat it, and this is known better"
            )
            out.append(
                f"the recording shows {_wrong_angles(explanation, s)}: the result is"
                f" for the angle that was found; {cure}"
            )
    return out


def _wrong_angles(explanation: Explanation, standing: Standing) -> str:
    """Angles that were set wrongly, with positions and size."""
    errors = angle_errors(explanation, standing)
    return " and ".join(
        f"a wrong angle, as {angle_errors_text(angles)} in {list_positions(positions)}"
        if angles
        else f"a wrong angle in {list_positions(positions)}"
        for positions, angles in errors.items()
    )


def _carries(calibration: Calibration, standing: Standing) -> bool:
    """Whether a cause is no effect, is random, or is in the calibration itself.

    An angle that was wrong is no effect; the squareness that a grade has may hide it
    from the fit, and no position is then left out.
    """
    with_it = calibration.info.get("carried", {}).get("causes", {})
    if any(cause.kind == "position" for cause, _ in standing.members):
        return standing.name in with_it
    effect = catalogue().get(standing.name)
    if effect is None or isinstance(effect, Scatter):
        return True
    carrying = {standing.name, *standing.aliases, effect.carried_by}
    if standing.name in TILTS and "beside_tilt_sigma_deg" in calibration.info:
        carrying |= {*TILTS}  # the one that fits, with some of the other one
    return bool(carrying & {*calibration.groups, *with_it})


def _moved(explanation: Explanation, out: Sequence[Standing]) -> dict[str, float]:
    """By how many sigmas each parameter moves with some causes, by full name."""
    names = {s.name for s in out}
    best = explanation.posterior.best
    kept = tuple(m for m in best.members if m[0].name not in names)
    search = explanation.posterior.search
    less: Set = search.evaluated(kept, search.sizes_of(best, kept))
    now, before = (calibration_of_set(explanation, one) for one in (best, less))
    return {
        name: float((now[name][0] - before[name][0]) / before[name][1])
        for name in now
        if name in before and before[name][1] > 0 and np.isfinite(now[name][0])
    }


def misread(prepared: PreparedRecording, calibration: Calibration) -> Calibration:
    """The calibration, not to be used where session.toml is found to be wrong."""
    sentences = []
    for name, fault in prepared.checked.faults:
        effect = catalogue()[name]
        if isinstance(effect, Chain) and effect.misread:
            values = ", ".join(f"{k} = {v}" for k, v in fault.values.items())
            mended = fault.mended is not None
            sentences.append(
                f"session.toml is wrong about the {name} ({values}): mend it and solve"
                " again; the numbers are those of"
                f" {'samples that were put right' if mended else 'what it states'}"
            )
    if not sentences:
        return calibration
    warnings = (*sentences, *calibration.warnings)
    return replace(calibration, warnings=warnings, good=False)


def with_not_carried(calibration: Calibration, missing: Uncarried) -> Calibration:
    """The calibration with a warning about causes that it does not carry."""
    if not missing.causes:
        return calibration
    name, sigmas = missing.most
    shown = " and ".join(
        f"{missing.described.get(id_, id_)} (probability {p:.2f})"
        for id_, p in missing.causes.items()
    )
    info = {"causes": dict(missing.causes), "moved_sigmas": dict(missing.moved)}
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
