"""Fits a parameter set to rows: linearised until it converges, without bad windows.

The state is moved to the estimate of the set (`model.search.gauss_newton`), turns
between windows are integrated with this state, and the most probable explanation is
taken (`mixture`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.samples import Array, Mask
from fieldcal.model import thresholds, tolerances
from fieldcal.model.evidence.gram import Gram
from fieldcal.model.evidence.sets import Sets
from fieldcal.model.posterior.mixture import Mixture
from fieldcal.model.rows.averages import Rows
from fieldcal.model.search.gauss_newton import GaussNewton
from fieldcal.model.state import State
from fieldcal.model.system.turn_rows import TurnRows, Turns
from fieldcal.model.system.window_rows import WindowSystem
from fieldcal.solve.averaging import mixture_with_causes
from fieldcal.solve.parameter_set import ParameterSet


@dataclass(frozen=True, slots=True)
class SettledSet:
    """A parameter set fitted about the state to which it converged.

    Attributes
    ----------
    mixture : posterior of the likeliest explanation
    gram : products of rows and columns
    turn_rows : rows of the turns
    score : log evidence from all windows, before any was left out

    """

    mixture: Mixture
    gram: Gram
    turn_rows: tuple[TurnRows, ...]
    score: float


def settle_without_bad_windows(
    rows: Rows, parameter_set: ParameterSet, nominal: State, turns: Turns | None
) -> SettledSet:
    """Fit the windows that agree; few may be left out."""

    def fit_without(windows: Mask) -> GaussNewton:
        kept = _without_windows(rows, parameter_set, windows)
        return GaussNewton(WindowSystem(kept, parameter_set), nominal, turns)

    bad, score = np.zeros(len(parameter_set.window_positions), dtype=bool), np.nan
    # one bad window of six can be told from scatter, two of six cannot
    most = max(1, len(bad) // 6)
    for _ in range(1 + most):
        fit = fit_without(bad)
        gram, mixture = _settled_fit(fit, fit, parameter_set)
        worst = mixture.bad * ~bad == (mixture.bad * ~bad).max(initial=0.0)
        if worst.any() and (mixture.bad[worst] > thresholds.SUSPECT).all():
            # a gross error moves the state out of the linear range
            gram, mixture = _settled_fit(fit, fit_without(bad | worst), parameter_set)
        if not bad.any():
            score = mixture.score
        worst &= (mixture.bad > thresholds.CERTAIN) & ~bad
        if not worst.any() or bad.sum() >= most:
            break
        bad |= worst
    mixture = replace(mixture, bad=np.where(bad, 1.0, mixture.bad))
    return SettledSet(mixture, gram, tuple(fit.turn_rows), score)


def _settled_fit(
    fit: GaussNewton, settling: GaussNewton, parameter_set: ParameterSet
) -> tuple[Gram, Mixture]:
    """Fit of the likeliest explanation about the state to which other rows converge."""
    gram = fit.gram(*_settled_state(settling, parameter_set), None)
    return gram, mixture_with_causes(
        parameter_set, Sets(parameter_set, gram), parameter_set.explanations[0].members
    )


def _without_windows(rows: Rows, parameter_set: ParameterSet, bad: Mask) -> Rows:
    """Rows in which bad windows (p,) have no weight."""
    left = np.isin(rows.x.position, parameter_set.window_positions[bad])
    return replace(
        rows, sd=np.where(left[:, None], tolerances.NO_WEIGHT_NOISE * rows.sd, rows.sd)
    )


def _settled_state(
    fit: GaussNewton, parameter_set: ParameterSet
) -> tuple[State, Array]:
    """The state to which the set converges, and the values of its columns there."""
    start: Array = np.zeros(parameter_set.width)
    state, values, _ = fit.approach(fit.nominal, start, parameter_set.members)
    if fit.turns is None:
        return state, values
    # windows measure only the Earth's rate: too little for scale factors of gyroscopes
    gyr = np.s_[parameter_set.scale + 3 : parameter_set.scale + 6]
    values[gyr] = 0.0
    nominal = np.append(state.scale[:3], fit.nominal.scale[3:])
    state = replace(state, scale=nominal)
    state, values = _follow_turns_first(fit, parameter_set, state, values)
    for again in range(tolerances.MAX_RELINEARISATIONS):
        if again:
            fit.follow_turns(state, values)
        before = state.scale
        state, values, _ = fit.approach(state, values, parameter_set.members)
        if np.abs(state.scale / before - 1).max() < tolerances.MIN_SCALE_CHANGE:
            break
    return state, values


def _follow_turns_first(
    fit: GaussNewton, parameter_set: ParameterSet, state: State, values: Array
) -> tuple[State, Array]:
    """Integrate the turns with the state from the windows, or with the nominal one.

    Parameters that the windows do not determine may be far off in that state, so that
    turns contradict the positions. If fewer turns do so with nominal parameters, the
    fit continues from there. Returns the state and the values to continue with.
    """
    contradicted = _contradicted_turns(fit, state, values)
    if not contradicted:
        return state, values
    zeros: Array = np.zeros(parameter_set.width)
    if _contradicted_turns(fit, fit.nominal, zeros) < contradicted:
        state, values, _ = fit.approach(fit.nominal, zeros, parameter_set.members)
        return state, values
    fit.follow_turns(state, values)
    return state, values


def _contradicted_turns(fit: GaussNewton, state: State, values: Array) -> int:
    """Number of turns that contradict the positions, integrated with a state."""
    fit.follow_turns(state, values)
    return len(fit.contradicted_turns)
