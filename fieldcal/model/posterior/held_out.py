"""Held-out residuals: each position, predicted from the others.

Each position in turn is left out, and everything is chosen again without it: the set
among the candidate sets, its variants, sizes and values. With too few windows,
stretches of time are left out instead. Only what belongs to the position alone (its set
angles, or an unknown orientation) is estimated from it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from fieldcal.core.samples import Array, Index, Mask
from fieldcal.model import resolutions, thresholds, tolerances
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.evidence.eliminated import Eliminated
from fieldcal.model.evidence.sets import Set, Sets
from fieldcal.model.system.fitted import FittedSet, estimates_by_column
from fieldcal.model.system.linear_rows import LinearRows
from fieldcal.model.system.linear_system import gram
from fieldcal.model.system.turn_rows import TurnRows


class HeldOut:
    """Predicts each part of a session from the others, with the columns of `sets`.

    `fitted` is the best set.
    """

    def __init__(self, fitted: FittedSet, sets: Sequence[Set]) -> None:
        self.fitted, self.dictionary = fitted, fitted.dictionary
        self.fold = folds(fitted.dictionary)
        columns = _columns(self.dictionary, sets) | (fitted.values != 0)
        self.columns = np.flatnonzero(columns)
        self.linear = [part.select_columns(columns) for part in fitted.linear]
        self._rest: dict[int, Sets | None] = {}

    def residual(self, sets: Sequence[Set]) -> Array:
        """Held-out residuals of all rows, (n, 6); nan where there is no prediction.

        For every part the best of `sets` is chosen again without it.
        """
        d, out = self.dictionary, np.full(self.fitted.rows.y.shape, np.nan)
        for i in np.unique(self.fold) if self.fold.max() else ():
            if (rest := self._without(int(i))) is None:
                continue
            left = self.fold == i
            chosen = max(
                (rest.evaluate(s.members, s.sizes) for s in sets), key=lambda s: s.score
            )
            estimate = estimates_by_column(chosen.state, d)
            step = self.fitted.values - estimate + _random_estimate(chosen, d)
            places = d.window_positions[np.isin(d.window_positions, d.x.position[left])]
            if len(d.window_positions) >= thresholds.MIN_ALIKE:
                step[d.rotations_of(places)] = 0.0
            rows = [p.select_rows(left[p.rows]) for p in self.linear]
            _predict(out, rows, step, chosen, d)
        return out

    def density(self, candidate: Set) -> float:
        """Log probability density of each part given the others, summed over the parts.

        The sizes are estimated from the others. A constant of the rows is omitted; nan
        where there is no prediction.
        """
        parts = list(self._parts(candidate))
        return (
            sum(whole.score - rest.score for whole, rest in parts) if parts else np.nan
        )

    def squares(self, candidate: Set) -> tuple[float, int]:
        """Sum of the whitened squares of the parts' predictions, and number of rows.

        The prediction's own uncertainty is counted,

            chi^2 = Q(all) - Q(others),   Q = (y - h)^T R^-1 (y - h) - b^T u

        with u the estimate and b = Phi^T R^-1 (y - h); (nan, 0) where none can be.
        """
        parts = list(self._parts(candidate))
        if not parts:
            return float("nan"), 0
        total = sum(
            _residual_square(whole) - _residual_square(rest) for whole, rest in parts
        )
        return total, sum(len(part.white) for part in self.linear)

    def _parts(self, candidate: Set) -> Iterator[tuple[Eliminated, Eliminated]]:
        """A set in all rows and without each part, at the sizes estimated without it.

        Empty if a part cannot be predicted.
        """
        all_rows = gram(
            self.linear, self.dictionary, self.fitted.values, (), self.columns
        )
        rests = [self._without(int(i)) for i in np.unique(self.fold)]
        if not self.fold.max() or None in rests:
            return
        for sets in filter(None, rests):
            fitted = sets.evaluate(candidate.members, candidate.sizes)
            tau = sets.instability_sigma(fitted.sizes.instability)
            rest = fitted.state
            whole = all_rows.with_instability(tau)
            yield Eliminated.of(whole, rest.columns, rest.prior_sigma), rest

    def _without(self, i: int) -> Sets | None:
        """Sets over the rows without a part; None if a channel has no others."""
        if i not in self._rest:
            left = self.fold == i
            rest = [part.select_rows(~left[part.rows]) for part in self.linear]
            values, d = self.fitted.values, self.dictionary
            determined = all(len(part.white) for part in rest)
            rows = gram(rest, d, values, (), self.columns) if determined else None
            self._rest[i] = None if rows is None else Sets(d, rows)
        return self._rest[i]


def held_out_residuals(fitted: FittedSet, sets: Sequence[Set]) -> Array:
    """Held-out residuals of all rows, by the best of some sets, (n, 6)."""
    return HeldOut(fitted, sets).residual(sets)


def candidate_sets(best: Set, visited: Sequence[Set]) -> list[Set]:
    """Sets that may be the best without a part: the best, those near it, the empty."""
    ranked = sorted(visited, key=lambda s: -s.score)
    near = [s for s in ranked if s.score > best.score - thresholds.OFFERED_LOG_DISTANCE]
    none = [s for s in ranked if not s.members]
    return list(dict.fromkeys([best, *near[: tolerances.MAX_COMPARED_SETS], *none]))


def held_out_turn_residuals(fitted: FittedSet, turns: Sequence[TurnRows]) -> Array:
    """Whitened held-out residuals of turns, from the windows and the other turns."""
    d, out = fitted.dictionary, []
    columns = _columns(d, [fitted.set]) | (fitted.values != 0)
    linear = [part.select_columns(columns) for part in fitted.linear]
    for i in range(min(len(turns), tolerances.MAX_FOLDS)):
        left = turns[i :: tolerances.MAX_FOLDS]
        kept = [t for t in turns if all(t is not other for other in left)]
        rows = gram(linear, d, fitted.values, kept, np.flatnonzero(columns))
        chosen = Sets(d, rows).evaluate(fitted.set.members, fitted.set.sizes)
        out += [turn_residual(t, estimates_by_column(chosen.state, d)) for t in left]
    return np.concatenate(out) if out else np.zeros(0)


def turn_residual(turn: TurnRows, estimate: Array) -> Array:
    """Whitened residuals of a turn's closure and way at some values of all columns."""
    values = estimate[turn.columns]
    closure = (turn.closure - turn.design @ values) * np.sqrt(turn.info)
    return np.concatenate([closure, turn.way - turn.way_design @ values])


def folds(d: Dictionary) -> Index:
    """Number of the part that each row is left out in, (n,)."""
    index = np.searchsorted(d.window_positions, d.x.position)
    if len(d.window_positions) >= thresholds.MIN_ALIKE:
        return (index % tolerances.MAX_FOLDS).astype(np.intp)
    out = np.zeros(len(index), dtype=np.intp)
    for p in d.window_positions:
        for i, part in enumerate(
            np.array_split(
                np.flatnonzero(d.x.position == p), resolutions.STRETCHES_PER_WINDOW
            )
        ):
            out[part] = i % tolerances.MAX_FOLDS
    return out


def _residual_square(eliminated: Eliminated) -> float:
    """Q of `squares`: weighted squares of the residuals, and of u by its prior."""
    rhs = eliminated.rows.rhs(eliminated.columns)
    return eliminated.rows.square - float(rhs @ eliminated.estimate)


def _columns(d: Dictionary, sets: Sequence[Set]) -> Mask:
    """Columns of some sets and all rotations of positions, (all,)."""
    out = np.zeros(d.width, dtype=bool)
    for candidate in sets:
        out[candidate.state.columns] = True
    out[d.rotations] = True
    return out


def _predict(
    out: Array, left: Sequence[LinearRows], step: Array, chosen: Set, d: Dictionary
) -> None:
    """Residuals of held-out rows, with each position's own angles estimated in it."""
    white = {p.channel: p.white + p.design @ step[p.columns] for p in left}
    wide = _angle_sigmas(chosen, d)
    for j, at in _angles(left, d):
        size = wide[at]
        if not size.any():
            continue
        a, z = [], []
        for part in left:
            rows = part.window == j
            angles = np.isin(part.columns, at)
            design = np.zeros((int(rows.sum()), 2))
            place = np.searchsorted(at, part.columns[angles])
            design[:, place] = part.design[np.ix_(rows, angles)]
            a.append(design * size)
            z.append(white[part.channel][rows])
        flat = np.concatenate(a)
        u = np.linalg.solve(flat.T @ flat + np.eye(2), flat.T @ np.concatenate(z))
        for part, design in zip(left, a, strict=True):
            white[part.channel][part.window == j] -= design @ u
    for part in left:
        out[part.rows, part.channel] = white[part.channel] / part.weight


def _random_estimate(chosen: Set, d: Dictionary) -> Array:
    """Estimates of permanent random groups, by column; not used in predictions."""
    out, first = np.zeros(d.width), 0
    for group in d.always:
        some = slice(first, first := first + len(group.columns))
        if group.random:
            np.add.at(out, group.columns, chosen.state.estimate[some])
    return out


def _angle_sigmas(chosen: Set, d: Dictionary) -> Array:
    """Prior standard deviations of the angles of each position, rad, by column."""
    out = np.zeros(d.width)
    np.add.at(out, chosen.state.columns, chosen.state.prior_sigma**2)
    out[d.rotations_of(d.window_positions[d.unoriented])] += 1.0
    only = np.zeros(d.width)
    only[d.rotations] = np.sqrt(out[d.rotations])
    return only


def _angles(left: Sequence[LinearRows], d: Dictionary) -> Iterator[tuple[int, Index]]:
    """Numbers of the held-out windows, with the columns of their rotations."""
    for j in np.unique(np.concatenate([p.window for p in left])).tolist():
        yield j, d.rotations_of(d.window_positions[j])
