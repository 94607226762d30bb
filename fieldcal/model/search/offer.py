"""One offer, and what a set may be given beside one instability."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model.causes.cause import Cause
from fieldcal.model.causes.dictionary import AlikeGroups
from fieldcal.model.evidence.gram import Eliminated
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import Member

Less = tuple[int, ...]
"""Indices of instabilities in `priors.SIZES`, (7,)."""

Best = dict[Cause, tuple[float, int, int]]
"""Of each cause what it would add, ln, the number of its variant, the index of size."""


@dataclass(frozen=True, slots=True, eq=False)
class Offer:
    """A member that a set may be given.

    Attributes
    ----------
    member : cause and variant
    score : of the set with it, predicted
    size : index of its likeliest size
    less : instability beside it

    """

    member: Member
    score: float
    size: int
    less: Less


@dataclass(frozen=True, slots=True, eq=False)
class OfferTable:
    """What may be added to a set beside one instability.

    Attributes
    ----------
    less : its instability
    state, score : of the set
    offers : the best first

    """

    less: Less
    state: Eliminated
    score: float
    offers: list[Offer]


def likelier(alike: AlikeGroups, apart: dict[int, Array]) -> Array:
    """Odds of what is likelier there than not before the rows are seen, ln, (m,).

    What begins in one triad where the device was off does so in the other one, whether
    or not rows show it; 0 of everything else.
    """
    out = np.zeros(len(alike.cause))
    for i, shares in apart.items():
        some = alike.cause == i
        out[some] = np.maximum(shares[alike.variant[some]], 0.0)
    return out


def offered(there: Set, score: float, less: Less, best: Best) -> list[Offer]:
    """What was found for a set that has not got it, the best first."""
    offers = [
        Offer((cause, cause.variants[v]), score + worth, size, less)
        for cause, (worth, v, size) in best.items()
        if cause.key not in there.keys
    ]
    return sorted(offers, key=lambda o: -o.score)
