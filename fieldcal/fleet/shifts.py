"""Shifts of a parameter by lot, station or operator, by the evidence of levels.

A unit's value is the mean m, a shift a of each level, the unit's own deviation u and
the error e:

    x_i = m + a_lot(i) + b_station(i) + ... + u_i + e_i,   u ~ N(0, t^2), e ~ N(0, s^2)

Each set of levels has its evidence (`levels`), averaged over the spread t of the units.
A unit counts by its probability of not being odd.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.fleet.levels import (
    EffectSetPosterior,
    Grouping,
    LevelEffect,
    PooledSessions,
)
from fieldcal.fleet.spread import UnitDistribution
from fieldcal.model import thresholds

CHANCE = 0.03
"""Prior probability that a given level shifts a given parameter."""

MAX_LEVELS = 2
"""Largest number of levels of a set."""

SPREADS: Array = np.geomspace(0.3, 1.2, 8)
"""Values of t that are averaged over, in units of the spread that includes shifts."""

COLUMN = np.zeros(1, dtype=np.intp)


@dataclass(frozen=True, slots=True)
class Shift:
    """A level whose groups differ in the mean of a parameter.

    Attributes
    ----------
    parameter : full name
    level : name of the level; several if they group the units alike
    probability : posterior probability of the shift
    labels : names of the groups
    values, sigmas : (g,) shift of each group against the mean, in the parameter's unit

    """

    parameter: str
    level: str
    probability: float
    labels: tuple[str, ...]
    values: Array
    sigmas: Array


def find_shifts(
    parameter: str,
    x: Array,
    sigma: Array,
    about: UnitDistribution,
    levels: Sequence[Grouping],
) -> list[Shift]:
    """Find the levels that probably shift a parameter, the most probable first.

    Parameters
    ----------
    parameter : its name
    x, sigma : (n,) value of each unit and its standard uncertainty
    about : distribution over all units
    levels : groupings of the units

    """
    size = about.spread or float(np.median(sigma))
    everyone = Grouping.of("all", ["all"] * len(x))
    sets = [
        c for k in range(MAX_LEVELS + 1) for c in combinations(range(len(levels)), k)
    ]
    scores, found = np.zeros(len(sets)), dict[tuple[int, ...], EffectSetPosterior]()
    for number, some in enumerate(sets):
        members = [
            LevelEffect(COLUMN, g) for g in (everyone, *(levels[i] for i in some))
        ]
        each = [
            _evidence_at_spread(x, sigma, about, size, ratio, members)
            for ratio in SPREADS
        ]
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
            values, sigmas = found[some].effect_values(1 + some.index(i))
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


def _evidence_at_spread(
    x: Array,
    sigma: Array,
    about: UnitDistribution,
    size: float,
    ratio: float,
    members: Sequence[LevelEffect],
) -> tuple[float, EffectSetPosterior]:
    """Log evidence of a set if units also differ by `ratio` times the spread."""
    variance = (ratio * about.spread) ** 2 + sigma**2
    weight = about.typical_probability / variance
    off = x - about.mean
    sessions = PooledSessions(
        (size**2 * weight)[:, None, None], (size * weight * off)[:, None]
    )
    found = sessions.posterior(members)
    alone = -0.5 * float(about.typical_probability @ np.log(variance) + weight @ off**2)
    return found.score + alone, found
