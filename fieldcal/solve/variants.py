"""Variants of an explanation, with its causes on other axes and with other shapes.

The search names the axes that certainly show a cause, and the shape that fits best.
Whether other axes have it too, and its time constant or instant, remain uncertain. An
explanation is therefore the mean over its variants, each weighted by its evidence over
all sizes with the other causes unchanged ((3) of `model.evidence`). There are hundreds,
and for two causes their product; a sample that is evenly spread over the probabilities
of each represents all. Source: Niederreiter 1992 for the points.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model import tolerances
from fieldcal.model.evidence.eliminated import evidence_gains
from fieldcal.model.evidence.sets import Sets, variant_log_priors
from fieldcal.model.evidence.sizing import LOG_DENSITY, UNIT_INDEX, Member
from fieldcal.solve.explanations import WeightedExplanation, has_equation


def variants(
    sets: Sets, known: tuple[Member, ...], explanation: WeightedExplanation
) -> list[WeightedExplanation]:
    """Variants of an explanation, with their probabilities if it is the right one.

    `known` are the other members of the set.
    """
    whole = (*known, *explanation.members)
    each = [_choices(sets, whole, m) for m in explanation.members]
    each += [_with_and_without(sets, whole, m) for m in explanation.possible_members]
    share: dict[tuple[Member, ...], float] = {}
    points = spread_points(
        len(each),
        max(1, round(tolerances.REPRESENTATIVE_POINTS * explanation.probability)),
    )
    for at in points:
        pairs = zip(at, each, strict=True)
        picked = [choices[choice_at(weight, u)] for u, (choices, weight) in pairs]
        members = tuple(m for chosen in picked for m in chosen)
        share[members] = share.get(members, 0.0) + 1 / len(points)
    return [WeightedExplanation(members, p) for members, p in share.items()]


def choice_at(weight: Array, u: float) -> int:
    """Index of the choice, of probabilities (k,), in which a point of 0 to 1 lies.

    >>> choice_at(np.array([0.3, 0.2, 0.2, 0.3]), 0.5)
    1
    """
    return int(
        np.searchsorted(np.cumsum(weight)[:-1], u - tolerances.ACCUMULATED_ROUNDING)
    )


def spread_points(count: int, points: int = tolerances.REPRESENTATIVE_POINTS) -> Array:
    """Points spread evenly over the unit cube, (points, count)."""
    if not count:
        return np.full((1, 0), 0.5)
    step = np.array([1 / points, *np.resize(np.sqrt(tolerances.PRIMES), count - 1)])
    out: Array = (np.arange(points)[:, None] * step + 0.5 / points) % 1.0
    return out


def _choices(
    sets: Sets, members: tuple[Member, ...], member: Member
) -> tuple[list[tuple[Member, ...]], Array]:
    """Variants of a cause of a set, and their probabilities.

    Each has the axes that the search names: it may have known more, as angles that a
    fit by the length of the force does not use.
    """
    cause, group = member
    shown = [i for i, v in enumerate(cause.variants) if {*group.params} <= {*v.params}]
    if not (has_equation(group) and shown[1:]):
        return [(member,)], np.ones(1)
    score = _scores(sets, members, member)[shown]
    weight: Array = np.exp(score - np.logaddexp.reduce(score))
    return [((cause, cause.variants[i]),) for i in shown], weight


def _with_and_without(
    sets: Sets, members: tuple[Member, ...], member: Member
) -> tuple[list[tuple[Member, ...]], Array]:
    """No further cause, or one of its variants, and their probabilities.

    The evidence of the best variant includes a new estimate of the instability.
    """
    cause = member[0]
    score = _scores(sets, members, member)
    best = (cause, cause.variants[int(np.argmax(score))])
    gain = sets.evaluate((*members, best)).score - sets.evaluate(members).score
    score = np.append(0.0, score - score.max() + gain)
    choices: list[tuple[Member, ...]] = [(), *(((cause, v),) for v in cause.variants)]
    out: Array = np.exp(score - np.logaddexp.reduce(score))
    return choices, out


def _scores(sets: Sets, members: tuple[Member, ...], member: Member) -> Array:
    """Log evidence of each variant of a cause with the other members, over all sizes.

    It includes the prior probability of each variant.
    """
    others, own = member[0].variants, member[1]
    every = np.unique(np.concatenate([g.columns for g in others]))
    rest = sets.evaluate(members).state.without(own.columns)
    inner, rhs = rest.schur_complement(every, np.ones(len(every)))
    alone = np.diag(rest.rows.matrix(every, every))
    beside = [m for m in members if m[0].key != member[0].key]
    score = variant_log_priors(member[0], beside) + np.zeros(len(others))
    width = np.array([len(g.columns) for g in others])
    for k in np.unique(width).tolist():
        alike = np.flatnonzero(width == k)
        at = np.searchsorted(every, [others[j].columns for j in alike])
        size = np.array([others[j].own_sigma() for j in alike])
        square = inner[at[:, :, None], at[:, None, :]]
        square *= size[:, :, None] * size[:, None, :]
        top = (alone[at] * size**2).max(axis=1)
        gain = evidence_gains(square, rhs[at] * size, top)
        known = np.array([others[j].fixed_size is not None for j in alike])
        summed = np.logaddexp.reduce(gain + LOG_DENSITY, axis=1)
        score[alike] += np.where(known, gain[:, UNIT_INDEX], summed)
    return score
