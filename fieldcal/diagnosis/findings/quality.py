"""Agreement of recording and simulation, before and after.

Lines average out in means over a second. Their mean squares, at their own frequency,
are added.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.diagnosis.explain import Explanation, base_of, inference_of
from fieldcal.diagnosis.findings.agreement import Agreement
from fieldcal.diagnosis.findings.found_effects import rms_of
from fieldcal.diagnosis.prepare import Prepared
from fieldcal.diagnosis.result import Quality
from fieldcal.model.posterior.held_out import held_out, turn_residual, turns_held_out
from fieldcal.model.rows.hand_tremor import rows_of
from fieldcal.model.rows.reduce import reduce
from fieldcal.model.system.fitted import Fitted
from fieldcal.model.system.turn_rows import TurnRows

OF_TURNS = "standard deviations, in turns"


def _agreement(
    fitted: Fitted, ahead: Array, lines: Array, predicted: Array, weighed: Fitted
) -> Agreement:
    """Residuals of a fit; squares are weighted with the instability of another fit."""
    same = fitted.rows.y.shape == weighed.rows.y.shape
    squares = weighed.squares_of(fitted.residual()) if same else fitted.squares
    return Agreement(
        fitted.rows,
        fitted.residual(fitted.certain),
        ahead,
        lines,
        predicted,
        float(squares.sum()) / max(fitted.dof, 1),
    )


def before(block: Block, explanation: Explanation) -> Agreement:
    """The simulation alone, compared with the samples as recorded."""
    prepared = explanation.prepared
    base = raw(block, explanation)
    lines = sum((r.before for r in prepared.remains), np.zeros(6))
    ahead = held_out(base, [base.set])
    return _agreement(base, ahead, lines, lines, explanation.best)


def after(explanation: Explanation) -> Agreement:
    """The simulation with the effects found; alone, if the rows show none."""
    remains, best = explanation.prepared.remains, explanation.best
    lines = sum((r.after for r in remains), np.zeros(6))
    predicted = sum((r.held_out for r in remains), np.zeros(6))
    if not best.set.members and not explanation.sees_earth:
        base = explanation.base
        ahead = held_out(base, [base.set])
        return _agreement(base, ahead, lines, predicted, best)
    ahead = explanation.held_out.residual(explanation.in_question)
    return _agreement(best, ahead, lines, predicted, best)


def in_turns(explanation: Explanation) -> tuple[Quality, Quality]:
    """The turns without and with the effects found, in standard deviations."""
    best, turned = explanation.best, explanation.inferred.turned
    nothing = explanation.posterior.search.evaluated(())
    plain = replace(best, set=nothing)
    return (
        _of_turns(plain, turned, turns_held_out(plain, turned)),
        _of_turns(best, turned, explanation.turns_held_out),
    )


def _of_turns(fitted: Fitted, turned: Sequence[TurnRows], ahead: Array) -> Quality:
    residual = np.concatenate([turn_residual(t, fitted.estimate) for t in turned])
    return Quality(rms_of(residual), float(np.mean(residual**2)), rms_of(ahead))


def raw(block: Block, explanation: Explanation) -> Fitted:
    """Fit of bias and scale factor alone to the samples as recorded."""
    prepared: Prepared = explanation.prepared
    if block is prepared.source.block and not prepared.checked.ids:
        return explanation.base
    source = replace(
        prepared.source,
        block=block,
        usable=np.hstack([np.isfinite(block.acc), np.isfinite(block.gyr)]),
    )
    # a device that was touched is not held by hand for that: rows of the same kind
    in_hand = prepared.rows.wander.any()
    rows = rows_of(source) if in_hand else reduce(source)
    return base_of(inference_of(source, rows, prepared), rows)


def parted(one: Agreement, other: Agreement) -> int:
    """The triad in which two models differ most, in residuals or predictions: 0 or 1.

    A random effect does not reduce the residuals, but it improves predictions.
    """
    sizes = []
    for triad in (0, 1):
        part, gains = slice(3 * triad, 3 * triad + 3), [0.0]
        for pair in ((one.whole, other.whole), (one.held_out, other.held_out)):
            first, then = (np.nan_to_num(some[part]) for some in pair)
            gain = float((first**2 - then**2).max())
            gains.append(gain / max(float(then.max()) ** 2, 1e-300))
        sizes.append(max(gains))
    known = [bool(np.isfinite(one.rms[3 * i : 3 * i + 3]).any()) for i in (0, 1)]
    if known[0] != known[1]:
        return int(known[1])
    return int(sizes[1] > sizes[0])
