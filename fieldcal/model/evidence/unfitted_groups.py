"""Groups that a device may have although a set does not contain them.

They have a known prior size, and are eliminated beside the set's own columns. Biases
larger than the stated grade allows make the errors of a coarser grade likely, but not
certain: a device with gyroscope biases of 5 deg/s may have accelerometers as linear as
those of tactical grade. Each kind of error then has the size s_1 of the stated grade or
s_2 of the coarser one. With gain(v) by (2) of `eliminated`, and the prior probability
AS_STATED of the stated grade, the probabilities of the two sizes have the ratio

    p_2 / p_1 = exp[gain(s_2) - gain(s_1)] (1 - AS_STATED) / AS_STATED             (1)
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import fields, replace

import numpy as np

from fieldcal.core.factory import WARMING_EFFECTS, FactoryErrors
from fieldcal.core.probability import probability_of_log_odds
from fieldcal.core.samples import CHANNELS, Index
from fieldcal.model import priors
from fieldcal.model.causes.cause import Group
from fieldcal.model.evidence.eliminated import Eliminated, gains_from_eigenvalues
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import gain_terms


def groups_not_in(fitted: Set, more: Sequence[Group]) -> list[Group]:
    """Groups, each named by its part, of effects that a set does not contain."""
    names = {cause.name for cause, _ in fitted.members}
    return [group for group in more if group.part not in names]


def parameters_not_in(fitted: Set, more: Sequence[Group]) -> Iterator[Group]:
    """The same, and of effects that it contains the parameters that it leaves out."""
    held = {cause.name: group.params for cause, group in fitted.members}
    for group in more:
        if group.part not in held:
            yield group
            continue
        lacks = ~np.isin(group.params, held[group.part])
        if lacks.any():
            yield replace(
                group,
                columns=group.columns[lacks],
                typical=group.typical[lacks],
                params=tuple(np.array(group.params)[lacks].tolist()),
            )


def eliminate_with(fitted: Set, more: Sequence[Group]) -> Eliminated:
    """Eliminate a set's columns and further groups, each with its typical sizes."""
    state = fitted.state
    columns = np.concatenate([state.columns, *(group.columns for group in more)])
    sizes = np.concatenate([state.prior_sigma, *(group.typical for group in more)])
    return Eliminated.of(state.rows, columns, sizes)


NONLINEARITIES = ("quadratic", "scale_asymmetry", "cubic")
"""Effects that share one size of `FactoryErrors`: a nonlinearity of unknown shape."""


def chances_of_coarser(
    state: Eliminated,
    groups: Sequence[Group],
    coarser: FactoryErrors,
    stated: FactoryErrors,
) -> dict[str, float]:
    """Probability of the coarser size of each kind of error, by `FactoryErrors`' names.

    Parameters
    ----------
    state : a set that contains the groups with the sizes of the coarser grade
    groups : errors that the factory left, each named by `part`
    coarser, stated : sizes by the two grades; equal sizes are omitted

    """
    chances = {}
    for kind, columns in _kinds(groups):
        most, least = getattr(coarser, kind), getattr(stated, kind)
        at = np.flatnonzero(np.isin(state.columns, columns))
        if len(at) and 0 < least < most:
            chances[kind] = _of_coarser(state, at, least / most)
    return chances


def _kinds(groups: Sequence[Group]) -> Iterator[tuple[str, Index]]:
    """The columns of each size of `FactoryErrors`, by its name."""
    for kind in (field.name for field in fields(FactoryErrors)):
        names = NONLINEARITIES if kind in NONLINEARITIES else (kind,)
        columns = [g.columns for g in groups if g.part in names]
        columns += [_of_biases(g, kind) for g in groups if g.part in WARMING_EFFECTS]
        yield kind, np.concatenate([np.empty(0, dtype=np.intp), *columns])


def _of_biases(group: Group, kind: str) -> Index:
    """Columns of a warm-up group whose size is one temperature coefficient."""
    triads = {"acc_per_k": CHANNELS[:3], "gyr_per_k": CHANNELS[3:]}
    at = [i for i, p in enumerate(group.params) if CHANNELS[p] in triads.get(kind, ())]
    return group.columns[at]


def _of_coarser(state: Eliminated, at: Index, part: float) -> float:
    """Probability that columns have the set's size, and not `part` of it, (1)."""
    smaller, whole = gains_from_eigenvalues(
        *gain_terms(state, at, 1.0), np.array([part, 1.0])
    )
    ahead = whole - smaller + np.log(1 / priors.AS_STATED_CHANCE - 1)  # (1)
    return float(probability_of_log_odds(ahead))
