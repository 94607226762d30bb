"""Compares a recording in motion with a simulator that follows the same motion.

The simulator's specific force and rate are the reference at every moment, so that the
causes found are those that the device has beyond it. Errors that the simulator has
itself appear with the opposite sign.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from fieldcal.against.motion.alignment import align_motion
from fieldcal.against.motion.explanation import MotionExplanation
from fieldcal.against.motion.following import explain_motion
from fieldcal.against.motion.free_calibration import (
    calibration_differences,
    determined_calibration,
    free_calibration_sizes,
)
from fieldcal.against.motion.noise_of_reference import noise_densities
from fieldcal.against.motion.placed import alignment_result, axes_difference
from fieldcal.against.motion.proof import predict_motion
from fieldcal.against.motion.shown_effects import effect_differences
from fieldcal.against.motion.wording import alignment_sentence
from fieldcal.against.result import Difference, Facts, Match, verdict_of
from fieldcal.against.wording import paragraph
from fieldcal.core.errors import InputError
from fieldcal.core.samples import ACC, CHANNELS, GYR, UNITS, Array, Block
from fieldcal.diagnosis.result import Quantity
from fieldcal.model import detections
from fieldcal.model.evidence.eliminated import Eliminated
from fieldcal.model.rows.reference import Reference
from fieldcal.model.rows.thermometer import Thermometer
from fieldcal.model.search.set_at_instability import with_typical_calibration
from fieldcal.physics.recording import grids_of
from fieldcal.session.description import Description


def compare_in_motion(
    real: tuple[Block, Description], sim: Block, names: tuple[str, str]
) -> Match:
    """Find what a simulator that follows a recording's motion leaves out.

    Parameters
    ----------
    real : all samples, SI, and what session.toml says
    sim : samples of the simulator, or of a better sensor, by a clock of its own
    names : what errors and warnings call them

    Raises
    ------
    InputError
        If they show no common motion, or too little of it.

    """
    block, about = real
    for name, side in zip(names, (block, sim), strict=True):
        _check_samples(name, side)
    found = explain_motion(
        block, about, Reference(sim), align_motion(block, sim, names)
    )
    standing = found.probable_causes()
    wide, _ = with_typical_calibration(found.inferred.fit.dictionary, found.set)
    state = _with_sizes(found, wide)
    free = _with_sizes(found, free_calibration_sizes(found, wide))
    every = (
        *effect_differences(found, standing, state),
        *calibration_differences(found, free),
        *axes_difference(found, state),
    )
    # certain differences stay in the order in which they were found
    differences = tuple(sorted(every, key=lambda d: -round(d.probability, 6)))
    verdict = verdict_of(differences)
    shown = predict_motion(found)
    predicted = shown.before, shown.after
    where = alignment_result(found, state)
    says = paragraph(verdict, differences, predicted, "Stretches")
    return Match(
        verdict,
        _probability(found, differences),
        differences,
        (),
        *predicted,
        _facts_of_the_device(block, found, free),
        _facts(sim),
        tuple(_warnings(found, names)),
        f"{says} {alignment_sentence(where)}",
        where,
    )


def _check_samples(name: str, block: Block) -> None:
    """Refuse a recording that is too short to show any motion."""
    known = int(np.isfinite(block.six).sum(axis=0).max())
    if known < detections.MIN_SAMPLES:
        raise InputError(
            f"{name}: its channels have {known} sample{'s' * (known != 1)} at most:"
            " compare some seconds of a motion"
        )


def _with_sizes(found: MotionExplanation, sizes: Array) -> Eliminated:
    """The best set of causes with other prior sizes."""
    before = found.set.state
    return Eliminated.of(before.rows, before.columns, sizes)


def _probability(found: MotionExplanation, differences: Sequence[Difference]) -> float:
    if differences:
        return float(np.prod([d.probability for d in differences]))
    return found.posterior.probability_of_noise_alone


def _facts(block: Block) -> Facts:
    """Properties of a recording: rate, steps, start."""
    grids = np.nan_to_num(grids_of(block))
    steps = [float(grids[c : c + 3].max()) or np.nan for c in (0, 3)]
    return Facts(
        rate_hz=1 / float(np.median(np.diff(block.t))),
        step_acc=steps[0],
        step_gyr=steps[1],
        start_s=float(block.t[0]),
        start_c=Thermometer.of(block).start_c,
        noise={},
    )


def _facts_of_the_device(
    block: Block, found: MotionExplanation, state: Eliminated
) -> Facts:
    """Properties of the device's recording, with its noise and calibration."""
    per_row, bands = found.rows.t.shape[1], found.fit.bands
    part = float(np.sqrt(0.5 / np.sum(found.rows.frequency >= bands.edges[-2])))
    noise: dict[str, Quantity] = {}
    for c, levels in found.fit.levels.items():
        level = float(np.sqrt(np.exp(levels[-1]) * per_row))
        noise[CHANNELS[c]] = Quantity(level, level * part, UNITS[c])
    return replace(
        _facts(block), noise=noise, calibration=determined_calibration(found, state)
    )


def _warnings(found: MotionExplanation, names: tuple[str, str]) -> Iterator[str]:
    """Warnings about what limits the comparison."""
    reference = found.rows.reference
    if len(reference.missing_channels):
        channels = ", ".join(CHANNELS[c] for c in reference.missing_channels)
        yield (
            f"{names[1]}: says nothing of {channels}, which are taken as constant:"
            " what moves there counts as noise"
        )
    for name, triad in (("accelerometers", ACC), ("gyroscopes", GYR)):
        if not reference.observed[triad].any():
            yield f"{names[1]}: has no {name}, so they are not compared"
    yield from (
        f"{names[1]}: its {name} have noise of their own, {density}, beside which they"
        " do not show quick motion: let the simulator write its motion without noise"
        for name, density in noise_densities(found)
    )
