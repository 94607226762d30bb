"""A recording held against a simulator's: what it leaves out, adds, or has too big."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.against import causes, offsets, prediction, samples
from fieldcal.against.facts import facts
from fieldcal.against.filters import filters
from fieldcal.against.pairing import Pairing
from fieldcal.against.result import Difference, Match, verdict_of
from fieldcal.against.side import Side, side
from fieldcal.against.wording import paragraph, undecided
from fieldcal.core.samples import CHANNELS, Block
from fieldcal.model import thresholds
from fieldcal.session.description import Description


def compare(
    real: tuple[Block, Description],
    simulator: tuple[Block, Description],
    names: tuple[str, str] = ("the recording", "the simulator"),
) -> Match:
    """Say what a simulator lacks of a recording, has beyond it, or has otherwise.

    Parameters
    ----------
    real, simulator : all samples, SI, and what session.toml says
    names : what warnings call them

    Raises
    ------
    InputError
        If nothing in one of them can be used.

    """
    one = side(names[0], *real)
    return matched(one, side(names[1], *simulator, one))


def matched(real: Side, sim: Side) -> Match:
    """Two sides held against each other."""
    found = causes.decided(Pairing(real, sim))
    apart = [
        *causes.differences(found),
        *offsets.differences(found),
        *offsets.earth(found),
        *filters(found),
        *samples.lines_and_faults(real, sim),
        *samples.noise(real, sim),
    ]
    apart.sort(key=lambda d: -d.probability)
    differences = tuple(d for d in apart if d.probability >= thresholds.DIFFERS)
    verdict = verdict_of(differences)
    predicted = prediction.before(found), prediction.after(real)
    warnings = (
        *_of(real), *_of(sim), *_quieted(sim), *_missing(found),
        *map(undecided, apart[len(differences) :]),
    )  # fmt: skip
    return Match(
        verdict,
        _probability(found, differences),
        differences,
        causes.alike(found),
        *predicted,
        facts(real, found.real),
        facts(sim, found.sim),
        warnings,
        paragraph(verdict, differences, predicted),
    )


def _probability(found: causes.Decided, differences: Sequence[Difference]) -> float:
    """That everything that is said to differ does, or that nothing does."""
    if differences:
        return float(np.prod([d.probability for d in differences]))
    return float(np.prod([1 - differ for _, differ in found.relations.values()]))


def _of(one: Side) -> list[str]:
    """Warnings of one diagnosis, with whose they are."""
    return [f"{one.name}: {warning}" for warning in one.diagnosis.warnings]


def _missing(found: causes.Decided) -> list[str]:
    """Outputs that one of the two has not."""
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


def _quieted(sim: Side) -> list[str]:
    if not sim.quieted:
        return []
    channels = ", ".join(CHANNELS[c] for c in sim.quieted)
    return [
        f"{sim.name}: {channels} have next to no noise; a tenth of the recording's was"
        " added to compare them"
    ]
