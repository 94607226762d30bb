"""A given set fitted to rows: linearised until it converges, without bad windows.

The state is moved to the estimate of the set (`model.inference`), turns between windows
are integrated with this state, and the most probable explanation is taken (`mixture`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model import thresholds
from fieldcal.model.evidence.gram import Gram
from fieldcal.model.posterior.mixture import Mixture
from fieldcal.model.rows.reduce import Rows
from fieldcal.model.search.inference import Inference
from fieldcal.model.search.selection import Search
from fieldcal.model.state import State
from fieldcal.model.system.turn_rows import TurnRows, Turns
from fieldcal.model.system.window_rows import WindowSystem
from fieldcal.solve.averaging import mixture_with_causes
from fieldcal.solve.observations import Mask
from fieldcal.solve.parameter_set import ParameterSet

FOLLOWED, NEAR = 6, 0.01
"""Times that turns are followed at most, and the change of a scale factor from which
once more: they are followed again in the end, and what is linear in a change leaves its
square, 1e-4 and then 1e-8."""

NO_WEIGHT = 1e5
"""Times its noise that a bad window is given where it must not bend the state."""


@dataclass(frozen=True, slots=True)
class SettledSet:
    """A set at the state where it settled.

    Attributes
    ----------
    found : the mixture of the likeliest explanation
    gram : products of rows and columns there
    turned : rows of the turns there
    score : ln of its evidence from all windows, before any was left out

    """

    mixture: Mixture
    gram: Gram
    turn_rows: tuple[TurnRows, ...]
    score: float


def settle_without_bad_windows(
    rows: Rows, parameter_set: ParameterSet, nominal: State, turns: Turns | None
) -> SettledSet:
    """The fit of the windows that agree, while those left out are few."""

    def inference(left: Mask) -> Inference:
        return Inference(
            WindowSystem(_without_windows(rows, parameter_set, left), parameter_set),
            nominal,
            turns,
        )

    bad, score = np.zeros(len(parameter_set.held), dtype=bool), np.nan
    # one bad window of six can be told from scatter, two of six cannot
    most = max(1, len(bad) // 6)
    for _ in range(1 + most):
        now = inference(bad)
        gram, found = _settled_fit(now, now, parameter_set)
        worst = found.bad * ~bad == (found.bad * ~bad).max(initial=0.0)
        if worst.any() and (found.bad[worst] > thresholds.SUSPECT).all():
            # a gross error bends the state so far that nothing is linear about it
            gram, found = _settled_fit(now, inference(bad | worst), parameter_set)
        if not bad.any():
            score = found.score
        worst &= (found.bad > thresholds.CERTAIN) & ~bad
        if not worst.any() or bad.sum() >= most:
            break
        bad |= worst
    found = replace(found, bad=np.where(bad, 1.0, found.bad))
    return SettledSet(found, gram, tuple(now.turned), score)


def _settled_fit(
    inference: Inference, settling: Inference, parameter_set: ParameterSet
) -> tuple[Gram, Mixture]:
    """The likeliest explanation about the state where other rows have settled."""
    gram = inference.gram(*_settled_state(settling, parameter_set), None)
    return gram, mixture_with_causes(
        parameter_set,
        Search(parameter_set, gram),
        parameter_set.explanations[0].members,
    )


def _without_windows(rows: Rows, parameter_set: ParameterSet, bad: Mask) -> Rows:
    """Rows of which some windows (p,) have no weight."""
    left = np.isin(rows.x.position, parameter_set.held[bad])
    return replace(rows, sd=np.where(left[:, None], NO_WEIGHT * rows.sd, rows.sd))


def _settled_state(
    inference: Inference, parameter_set: ParameterSet
) -> tuple[State, Array]:
    """The state where the set has settled, and the columns' values in it."""
    start: Array = np.zeros(parameter_set.width)
    state, values, _ = inference.settled(
        inference.nominal, start, parameter_set.members
    )
    if inference.turns is None:
        return state, values
    # windows see no rate but the Earth's, too little to follow turns by
    gyr = np.s_[parameter_set.scale + 3 : parameter_set.scale + 6]
    values[gyr] = 0.0
    nominal = np.append(state.scale[:3], inference.nominal.scale[3:])
    state = replace(state, scale=nominal)
    state, values = _follow_turns_first(inference, parameter_set, state, values)
    for again in range(FOLLOWED):
        if again:
            inference.followed(state, values)
        before = state.scale
        state, values, _ = inference.settled(state, values, parameter_set.members)
        if np.abs(state.scale / before - 1).max() < NEAR:
            break
    return state, values


def _follow_turns_first(
    inference: Inference, parameter_set: ParameterSet, state: State, values: Array
) -> tuple[State, Array]:
    """Follow the turns by the state that windows led to; back comes where to go on.

    What windows leave open may be anywhere in that state, and gyroscopes then lead
    elsewhere for no other reason. If they do so in fewer turns where everything is
    nominal, those turns are what tells the rest.
    """
    astray = _contradicted_turns(inference, state, values)
    if not astray:
        return state, values
    nothing: Array = np.zeros(parameter_set.width)
    if _contradicted_turns(inference, inference.nominal, nothing) < astray:
        state, values, _ = inference.settled(
            inference.nominal, nothing, parameter_set.members
        )
        return state, values
    inference.followed(state, values)
    return state, values


def _contradicted_turns(inference: Inference, state: State, values: Array) -> int:
    """In how many turns the gyroscopes lead elsewhere by a state."""
    inference.followed(state, values)
    return len(inference.turns.turning.contradicted) if inference.turns else 0
