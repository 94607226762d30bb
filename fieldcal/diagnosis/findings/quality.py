"""Agreement of recording and simulation, without and with the effects found.

Lines average out in means over a second, so their mean squares at their own frequency
are added.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.findings.agreement import ModelResiduals, root_mean_square
from fieldcal.diagnosis.fit import build_fit, fit_calibration_only
from fieldcal.diagnosis.prepare import PreparedRecording
from fieldcal.diagnosis.result import Quality
from fieldcal.model.posterior.held_out import (
    held_out_residuals,
    held_out_turn_residuals,
    turn_residual,
)
from fieldcal.model.rows.hand_tremor import rows_of_recording
from fieldcal.model.rows.reduce import reduce_to_rows
from fieldcal.model.system.fitted import FittedSet
from fieldcal.model.system.turn_rows import TurnRows

TURN_UNIT = "standard deviations, in turns"


def _model_residuals(
    fitted: FittedSet, ahead: Array, lines: Array, predicted: Array, weighed: FittedSet
) -> ModelResiduals:
    """Residuals of a fit; its chi squared has the instability of another fit."""
    same = fitted.rows.y.shape == weighed.rows.y.shape
    squares = weighed.squares_of(fitted.residual()) if same else fitted.squares
    return ModelResiduals(
        fitted.rows, fitted.residual(fitted.deterministic_estimate), ahead, lines,
        predicted, float(squares.sum()) / max(fitted.dof, 1),
    )  # fmt: skip


def simulation_residuals(block: Block, explanation: Explanation) -> ModelResiduals:
    """Residuals of the simulation alone, against the samples as recorded."""
    prepared = explanation.prepared
    base = fit_recorded_samples(block, explanation)
    lines = sum((r.before for r in prepared.line_remainders), np.zeros(6))
    ahead = held_out_residuals(base, [base.set])
    return _model_residuals(base, ahead, lines, lines, explanation.best)


def explained_residuals(explanation: Explanation) -> ModelResiduals:
    """Residuals of the simulation with the effects found, if any were found."""
    remains, best = explanation.prepared.line_remainders, explanation.best
    lines = sum((r.after for r in remains), np.zeros(6))
    predicted = sum((r.held_out for r in remains), np.zeros(6))
    if not best.set.members and not explanation.each_window_shows_earth_rate:
        base = explanation.calibration_only
        ahead = held_out_residuals(base, [base.set])
        return _model_residuals(base, ahead, lines, predicted, best)
    ahead = explanation.held_out.residual(explanation.rival_sets)
    return _model_residuals(best, ahead, lines, predicted, best)


def turn_quality(explanation: Explanation) -> tuple[Quality, Quality]:
    """Quality in the turns without and with the effects, in standard deviations."""
    best, turned = explanation.best, explanation.inferred.turn_rows
    nothing = explanation.posterior.sets.evaluate(())
    plain = replace(best, set=nothing)
    return (
        _quality_of_turns(plain, turned, held_out_turn_residuals(plain, turned)),
        _quality_of_turns(best, turned, explanation.turns_held_out),
    )


def _quality_of_turns(
    fitted: FittedSet, turned: Sequence[TurnRows], ahead: Array
) -> Quality:
    residual = np.concatenate([turn_residual(t, fitted.estimate) for t in turned])
    return Quality(
        root_mean_square(residual), float(np.mean(residual**2)), root_mean_square(ahead)
    )


def fit_recorded_samples(block: Block, explanation: Explanation) -> FittedSet:
    """Fit of bias and scale factor alone to the samples as recorded."""
    prepared: PreparedRecording = explanation.prepared
    if block is prepared.source.block and not prepared.checked.ids:
        return explanation.calibration_only
    source = replace(
        prepared.source,
        block=block,
        usable=np.hstack([np.isfinite(block.acc), np.isfinite(block.gyr)]),
    )
    # rows of the same kind as before: by-hand or not is not decided again
    in_hand = prepared.rows.hand_angle.any()
    rows = rows_of_recording(source) if in_hand else reduce_to_rows(source)
    fit = build_fit(replace(prepared, source=source, rows=rows))
    return fit_calibration_only(fit, rows)


def most_different_triad(one: ModelResiduals, other: ModelResiduals) -> int:
    """The triad, 0 or 1, in which two models differ most, by residuals or predictions.

    A random effect does not reduce the residuals, but it improves predictions.
    """
    sizes = []
    for triad in (0, 1):
        part, gains = slice(3 * triad, 3 * triad + 3), [0.0]
        for pair in (
            (one.rms_with_lines, other.rms_with_lines),
            (one.held_out_rms, other.held_out_rms),
        ):
            first, then = (np.nan_to_num(rms[part]) for rms in pair)
            gain = float((first**2 - then**2).max())
            gains.append(gain / max(float(then.max()) ** 2, 1e-300))
        sizes.append(max(gains))
    known = [bool(np.isfinite(one.rms[3 * i : 3 * i + 3]).any()) for i in (0, 1)]
    if known[0] != known[1]:
        return int(known[1])
    return int(sizes[1] > sizes[0])
