"""Whether a parameter differs by lot, station or operator: evidence of levels.

A unit's value is the lot's mean, what its station and the like add, what the unit is
itself, and its error:

    x_i = m + a_lot(i) + b_station(i) + ... + u_i + e_i,   u ~ N(0, t^2), e ~ N(0, s^2)

Every set of levels has its evidence (`levels`), averaged over what units differ by
besides; odd units count as far as they are none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.fleet.levels import Grouping, Member, Sessions, WeighedMembers
from fieldcal.fleet.spread import UnitSpread
from fieldcal.model import thresholds

CHANCE = 0.03
"""Chance that a given level shifts a given parameter."""

TOGETHER = 2
"""Levels of one parameter that are weighed together."""

SPREADS: Array = np.geomspace(0.3, 1.2, 8)
"""What units differ by besides, in the spread with all shifts in it."""

COLUMN = np.zeros(1, dtype=np.intp)


@dataclass(frozen=True, slots=True)
class Shift:
    """A level that shifts a parameter.

    Attributes
    ----------
    parameter : full name
    level : name; several where no unit tells them apart
    probability : that it does
    labels : of the groups
    values, sigmas : (g,) shift of each against the mean, in the parameter's unit

    """

    parameter: str
    level: str
    probability: float
    labels: tuple[str, ...]
    values: Array
    sigmas: Array


def shifts(
    parameter: str,
    x: Array,
    sigma: Array,
    about: UnitSpread,
    levels: Sequence[Grouping],
) -> list[Shift]:
    """Levels that shift a parameter more likely than not, the likeliest first.

    Parameters
    ----------
    parameter : its name
    x, sigma : (n,) value of each unit and its uncertainty
    about : the spread of all
    levels : groupings of the units

    """
    size = about.spread or float(np.median(sigma))
    everyone = Grouping.of("all", ["all"] * len(x))
    sets = [c for k in range(TOGETHER + 1) for c in combinations(range(len(levels)), k)]
    scores, found = np.zeros(len(sets)), dict[tuple[int, ...], WeighedMembers]()
    for number, some in enumerate(sets):
        members = [Member(COLUMN, g) for g in (everyone, *(levels[i] for i in some))]
        each = [_at(x, sigma, about, size, ratio, members) for ratio in SPREADS]
        chance = len(some) * np.log(CHANCE / (1 - CHANCE))
        scores[number] = np.logaddexp.reduce([s for s, _ in each]) + chance
        found[some] = max(each, key=lambda one: one[0])[1]
    weight = np.exp(scores - np.logaddexp.reduce(scores))
    out = []
    for i, level in enumerate(levels):
        having = [n for n, some in enumerate(sets) if i in some]
        probability = float(weight[having].sum())
        if probability > thresholds.NAMED:
            some = sets[max(having, key=lambda n: weight[n])]
            values, sigmas = found[some].of(1 + some.index(i))
            out.append(
                Shift(
                    parameter,
                    " or ".join(level.names),
                    probability,
                    level.labels,
                    values[:, 0] * size,
                    sigmas[:, 0] * size,
                )
            )
    return sorted(out, key=lambda one: -one.probability)


def _at(
    x: Array,
    sigma: Array,
    about: UnitSpread,
    size: float,
    ratio: float,
    members: Sequence[Member],
) -> tuple[float, WeighedMembers]:
    """Evidence of a set where units differ by some part of the spread besides."""
    variance = (ratio * about.spread) ** 2 + sigma**2
    weight = about.typical / variance
    off = x - about.mean
    sessions = Sessions(
        (size**2 * weight)[:, None, None], (size * weight * off)[:, None]
    )
    found = sessions.weighed(members)
    alone = -0.5 * float(about.typical @ np.log(variance) + weight @ off**2)
    return found.score + alone, found
