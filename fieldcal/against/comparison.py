"""Compares a recording with a simulator's output, position by position."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.against import causes, offsets, prediction
from fieldcal.against.facts import recording_facts
from fieldcal.against.filters import filter_difference
from fieldcal.against.lines_and_faults import compare_lines_and_faults
from fieldcal.against.noise_levels import noise_differences
from fieldcal.against.pairing import CausePairing
from fieldcal.against.result import Difference, Match, verdict_of
from fieldcal.against.side import DiagnosedRecording, diagnose_side
from fieldcal.against.wording import paragraph, possible_difference
from fieldcal.core.samples import CHANNELS, Block
from fieldcal.model import thresholds
from fieldcal.session.description import Description


def compare(
    real: tuple[Block, Description],
    simulator: tuple[Block, Description],
    names: tuple[str, str] = ("the recording", "the simulator"),
) -> Match:
    """Find what a simulator leaves out, adds, or has with another size.

    Parameters
    ----------
    real, simulator : all samples, SI, and what session.toml says
    names : what warnings call them

    Raises
    ------
    InputError
        If nothing in one of them can be used.

    """
    one = diagnose_side(names[0], *real)
    return compare_sides(one, diagnose_side(names[1], *simulator, one))


def compare_sides(real: DiagnosedRecording, sim: DiagnosedRecording) -> Match:
    """Compare two diagnosed recordings."""
    found = causes.decide_causes(CausePairing(real, sim))
    in_samples, alike = compare_lines_and_faults(real, sim)
    apart = [
        *causes.differences(found),
        *offsets.calibration_differences(found),
        *offsets.earth_rate_difference(found),
        *filter_difference(found),
        *in_samples,
        *noise_differences(real, sim),
    ]
    apart.sort(key=lambda d: -d.probability)
    differences = tuple(d for d in apart if d.probability >= thresholds.DIFFERS)
    verdict, possible = verdict_of(differences), apart[len(differences) :]
    predicted = (
        prediction.predict_as_simulated(found),
        prediction.predict_as_explained(real),
    )
    warnings = (
        *_warnings_of(real), *_warnings_of(sim), *_added_noise(sim),
        *_missing_outputs(found),
        *map(possible_difference, possible),
    )  # fmt: skip
    return Match(
        verdict,
        _probability(found, differences),
        differences,
        (*causes.shared_causes(found), *alike),
        *predicted,
        recording_facts(real, found.real),
        recording_facts(sim, found.sim),
        warnings,
        paragraph(verdict, differences, predicted, possible=possible),
    )


def _probability(
    found: causes.DecidedCauses, differences: Sequence[Difference]
) -> float:
    """Probability that all reported differences exist, or that none does.

    What one of the two cannot show is not compared.
    """
    if differences:
        return float(np.prod([d.probability for d in differences]))
    alike = [
        1 - relation.differs
        for key, relation in found.relations.items()
        if found.both_show(key)
    ]
    return float(np.prod(alike))


def _warnings_of(one: DiagnosedRecording) -> list[str]:
    """Warnings of one diagnosis, each with the name of its recording."""
    return [f"{one.name}: {warning}" for warning in one.diagnosis.warnings]


def _missing_outputs(found: causes.DecidedCauses) -> list[str]:
    """Warnings about outputs that only one of the two has."""
    ours, theirs = found.real.observed, found.sim.observed
    real, sim = found.pairing.real, found.pairing.sim
    out = []
    for one, lost in (
        (sim, np.setdiff1d(ours, theirs)),
        (real, np.setdiff1d(theirs, ours)),
    ):
        if len(lost):
            names = ", ".join(CHANNELS[c] for c in lost)
            out.append(f"{one.name}: has nothing of {names}, so they are not compared")
    return out


def _added_noise(sim: DiagnosedRecording) -> list[str]:
    if not sim.noise_added:
        return []
    channels = ", ".join(CHANNELS[c] for c in sim.noise_added)
    return [
        f"{sim.name}: {channels} have next to no noise; a tenth of the recording's was"
        " added to compare them"
    ]
