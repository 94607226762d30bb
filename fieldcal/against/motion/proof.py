"""Predicts stretches of a recording in motion that were held out.

A few consecutive stretches are held out at a time. Noise, the best of the rival sets,
its sizes and its values are estimated again from the rest, with the columns linearised
about the fit of all. The uncertainty of a prediction counts as in (1) of
`fieldcal.against.prediction`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.against.motion.explanation import MotionExplanation
from fieldcal.against.prediction import chi2_of_uncertain_prediction
from fieldcal.against.result import SimulatorPrediction
from fieldcal.core.samples import Array, Index
from fieldcal.model.evidence.sets import Set, Sets
from fieldcal.model.posterior.held_out import candidate_sets
from fieldcal.model.rows.motion import MotionRows, frequencies
from fieldcal.model.state import State
from fieldcal.model.system.linear_rows import LinearRows
from fieldcal.model.system.linear_system import gram
from fieldcal.model.system.motion_rows import noise_levels

FOLDS = 6
"""Parts of a recording that are held out in turn, each of consecutive stretches."""

ROUNDS = 2
"""Alternating estimates of noise and values when a part is held out."""


@dataclass(frozen=True)
class MotionPrediction:
    """Agreement of a recording with its prediction, without and with the causes found.

    Attributes
    ----------
    before : by the simulator alone; only the alignment is fitted
    after : with the causes found; each part is predicted from the others

    """

    before: SimulatorPrediction
    after: SimulatorPrediction


def predict_motion(found: MotionExplanation) -> MotionPrediction:
    """Predict each part of a recording."""
    return MotionPrediction(_as_simulated(found), _as_explained(found))


def _as_simulated(found: MotionExplanation) -> SimulatorPrediction:
    system = found.fit.system
    d, nominal = system.dictionary, found.fit.nominal
    nothing = np.zeros(d.width, dtype=bool)
    nothing[d.bias : d.bias + 6] = True  # a channel has rows where it has a column
    places = np.zeros((d.position_count, 2))
    bare = State(nominal.bias, nominal.scale, places, np.zeros(3))
    linear = system.linearised(bare, nothing)
    squares, count, off = 0.0, 0, _ResidualSquares()
    for part in linear:
        told = found.rows.frequency <= found.fit.hz[part.channel]
        off.add(part, part.white, told)
        squares += float(part.white @ part.white)
        count += int(told.sum())
    return off.prediction(squares, count)


def _as_explained(found: MotionExplanation) -> SimulatorPrediction:
    inferred, system = found.inferred, found.fit.system
    visited = list(inferred.search.sets.visited.values())
    candidates = candidate_sets(inferred.best, visited)
    d, values = system.dictionary, inferred.fit.pad(inferred.values)
    wanted = inferred.fit.wanted_columns([m for s in candidates for m in s.members])
    linear = system.linearised(inferred.state, wanted | (values != 0))
    rows, fold, hz = found.rows, _folds(found), found.fit.hz
    squares, count, off = 0.0, 0, _ResidualSquares()
    for i in np.unique(fold):
        kept, gone = np.flatnonzero(fold != i), np.flatnonzero(fold == i)
        rest = [_of_stretches(part, rows, kept) for part in linear]
        frequency = frequencies(len(kept) * rows.length, rows.length, rows.step)
        for _ in range(ROUNDS):
            sets = Sets(d, gram(rest, d, values, (), np.flatnonzero(wanted)))
            best = max(
                (sets.evaluate(c.members, c.sizes) for c in candidates), key=_score
            )
            levels = noise_levels(found.fit.bands, frequency, rest, values, best.state)
            rest = [_reweighted(found, p, levels, frequency) for p in rest]
        frequency = frequencies(len(gone) * rows.length, rows.length, rows.step)
        left = [_of_stretches(part, rows, gone) for part in linear]
        left = [_reweighted(found, part, levels, frequency) for part in left]
        squares += _squares(left, values, best)
        for part in left:
            off.add(part, _residual(part, values, best), frequency <= hz[part.channel])
            count += int((frequency <= hz[part.channel]).sum())
    return off.prediction(squares, count)


class _ResidualSquares:
    """Sums of squared residuals of each triad, and their number."""

    def __init__(self) -> None:
        self.square, self.count = np.zeros(2), np.zeros(2)

    def add(self, part: LinearRows, white: Array, told: NDArray[np.bool_]) -> None:
        """Add whitened residuals of a channel where `told` (n,) is true."""
        triad = part.channel // 3
        self.square[triad] += float(np.sum((white / part.weight)[told] ** 2))
        self.count[triad] += len(white)

    def prediction(self, squares: float, count: int) -> SimulatorPrediction:
        """The rms of both triads, with chi squared."""
        with np.errstate(invalid="ignore"):
            acc, gyr = np.sqrt(self.square / self.count)
        return SimulatorPrediction(float(acc), float(gyr), squares / count)


def _score(one: Set) -> float:
    return one.score


def _folds(found: MotionExplanation) -> Index:
    """The part with which each stretch is held out, (s,)."""
    count = int(found.rows.stretch[-1]) + 1
    return np.arange(count) * min(FOLDS, count) // count


def _of_stretches(part: LinearRows, rows: MotionRows, some: Index) -> LinearRows:
    """A channel's coefficients of some stretches only, with unchanged weights."""
    every = np.column_stack([part.white, part.design]) / part.weight[:, None]
    raw = rows.select_stretches(every, some)
    weight = part.weight.reshape(-1, rows.length)[some].ravel()
    window = part.window.reshape(-1, rows.length)[some].ravel()
    raw *= weight[:, None]
    return replace(
        part, rows=np.arange(len(weight)), window=window, weight=weight,
        design=raw[:, 1:], white=raw[:, 0],
    )  # fmt: skip


def _reweighted(
    found: MotionExplanation,
    part: LinearRows,
    levels: Mapping[int, Array],
    frequency: Array,
) -> LinearRows:
    """A channel's coefficients with another power of the noise."""
    c = part.channel
    weight = found.fit.power(c, levels[c], frequency) ** -0.5
    ratio = weight / part.weight
    return replace(
        part, weight=weight, design=part.design * ratio[:, None],
        white=part.white * ratio,
    )  # fmt: skip


def _residual(part: LinearRows, values: Array, best: Set) -> Array:
    """Whitened coefficients less those that a set predicts."""
    estimate: Array = np.zeros(len(values))
    np.add.at(estimate, best.state.columns, best.state.estimate)
    step = (values - estimate)[part.columns]
    out: Array = part.white + part.design @ step
    return out


def _squares(left: Sequence[LinearRows], values: Array, best: Set) -> float:
    """Chi squared of the held-out part, with the uncertainty of the prediction."""
    state = best.state
    inner = np.zeros((len(state.columns), len(state.columns)))
    rhs, square = np.zeros(len(state.columns)), 0.0
    for part in left:
        place = np.full(len(values), -1, dtype=np.intp)
        place[part.columns] = np.arange(len(part.columns))
        here = np.flatnonzero(place[state.columns] >= 0)
        design = part.design[:, place[state.columns[here]]]
        white = _residual(part, values, best)
        inner[np.ix_(here, here)] += design.T @ design
        rhs[here] += design.T @ white
        square += float(white @ white)
    return chi2_of_uncertain_prediction(square, rhs, inner, state.inverse)
