"""Two causes at once, of which neither may be worth it alone.

Of groups i and j beside a set, the sizes are sought in turn, each beside the other at
its likeliest, by (3) of `evidence`: what one alone needs to make up for both it does
not need beside the other.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, pairwise

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model import priors
from fieldcal.model.causes import Group
from fieldcal.model.evidence import Eliminated, Index, gains
from fieldcal.model.sizing import DENSITY, EVEN


def pairs(
    state: Eliminated, groups: Sequence[Group], sizes: Sequence[int]
) -> Iterator[tuple[float, tuple[int, int], tuple[int, int]]]:
    """Gain of every two groups beside a set, their numbers, and their sizes.

    Parameters
    ----------
    state : the set, eliminated
    groups : that it may be given
    sizes : index in `priors.SIZES` of each one's likeliest size alone

    """
    if len(groups) < 2:
        return
    columns = np.concatenate([g.columns for g in groups])
    typical = np.concatenate([g.typical for g in groups])
    inner, pull = state.rest(columns, typical)
    first = np.cumsum([0, *(len(g.columns) for g in groups)])
    at = [np.arange(a, b) for a, b in pairwise(first.tolist())]
    alone = [_profile(inner, pull, one) for one in at]
    for i, j in combinations(range(len(groups)), 2):
        found = []
        for start in (sizes[i], EVEN):
            v = int(_beside(inner, pull, at[j], at[i], start).argmax())
            profile = _beside(inner, pull, at[i], at[j], v)
            u = int(profile.argmax())
            found.append((float(alone[j][v] + profile[u]), (u, v)))
        gain, both = max(found)
        yield gain, (i, j), both


def _profile(inner: Array, pull: Array, one: Index) -> Array:
    """Gain and density over the sizes of one group."""
    own = inner[np.ix_(one, one)]
    out: Array = gains(own, pull[one], np.diag(own).max()) + DENSITY
    return out


def _beside(inner: Array, pull: Array, one: Index, other: Index, size: int) -> Array:
    """The same beside another group at some size."""
    v = float(priors.SIZES[size])
    taken = inner[np.ix_(other, other)] + np.eye(len(other)) / v**2
    shared = inner[np.ix_(other, one)]
    back = np.linalg.solve(taken, np.column_stack([shared, pull[other]]))
    own = inner[np.ix_(one, one)]
    rest, left = own - shared.T @ back[:, :-1], pull[one] - shared.T @ back[:, -1]
    out: Array = gains(rest, left, np.diag(own).max()) + DENSITY
    return out
