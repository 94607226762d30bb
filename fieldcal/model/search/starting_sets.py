"""Sets from which a search begins whose states may be far from the nominal one.

The rows are linearised about the nominal state first. An explanation that changes the
state by much may look unlikely there, and is tried about its own state as well.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from fieldcal.core.gravity import G0
from fieldcal.core.samples import GYR
from fieldcal.model import priors
from fieldcal.model.evidence.gram import Gram
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.search.gauss_newton import GaussNewton
from fieldcal.model.search.selection import Search
from fieldcal.model.system.fitted import estimates_by_column
from fieldcal.model.system.turn_rows import TurnRows
from fieldcal.physics.effect import Sensor

LARGE_INSTABILITY = 4.0
"""Instability, in typical ones, above which causes may hide that show only together."""


def starting_sets(fit: GaussNewton, search: Search, best: Set) -> Iterator[Set]:
    """Starting sets beside the one from which `best` was found about the nominal state.

    The rows of turns are those of the fit when each set is asked for.
    """
    for large in (_set_with_large_angle(search), _set_with_large_turn(search)):
        if large is not None:
            yield large
    if elsewhere := _positions_elsewhere(fit):
        yield search.sets.evaluate(elsewhere)
    usual = tuple((c, c.variants[0]) for c in fit.dictionary.causes if c.usual)
    keys = {c.key for c, _ in usual}
    instability = priors.SIZES[list(best.sizes.instability)]
    if (instability.max() > LARGE_INSTABILITY and not keys <= best.keys) or (
        _turns_need_usual_causes(fit.turn_rows, best, keys)
    ):
        yield search.sets.evaluate(usual)


def visible_angle(gram: Gram) -> float:
    """Smallest angle whose square the accelerometers show, rad.

    Half of it, times gravity, is as large as the noise of a window's mean.
    """
    info = gram.info[gram.kind < GYR.start]
    sigma = 1 / np.sqrt(np.median(info[info > 0])) if info.any() else np.inf
    return float(np.sqrt(2 * sigma / G0))


def _set_with_large_angle(search: Search) -> Set | None:
    """Set of one position with a large angle error, if there seems to be one.

    A large angle is not linear: about the stated angle its residuals make it less
    likely than causes with more columns. It is large if its square shows.
    """
    sets = search.sets
    empty = sets.evaluate(())
    for offer in search.offers.ranked(empty):
        cause, group = offer.member
        if cause.kind != "position":
            continue
        moved = search.offers.accept(empty, offer)
        angles = estimates_by_column(moved.state, sets.dictionary)[group.columns]
        return moved if np.abs(angles).max() >= visible_angle(sets.gram) else None
    return None


def _set_with_large_turn(search: Search) -> Set | None:
    """Set of one effect that turns the device at an instant, if by a large angle.

    A base that is knocked by a degree is less likely about the base as it stood than a
    bias that jumps, and whatever else makes up for the length of the force.
    """
    sets = search.sets
    empty = sets.evaluate(())
    for offer in search.offers.ranked(empty):
        _, group = offer.member
        effect = group.effect
        if not (isinstance(effect, Sensor) and effect.nonlinear):
            continue
        turned = search.offers.accept(empty, offer)
        values = estimates_by_column(turned.state, sets.dictionary)[group.columns]
        size = np.linalg.norm(np.deg2rad(values))
        return turned if size >= visible_angle(sets.gram) else None
    return None


def _positions_elsewhere(fit: GaussNewton) -> tuple[Member, ...]:
    """Positions whose force is far from the stated one, if they are the fewer.

    Two that were exchanged hide each other: about the stated angles, everything else
    seems likelier.
    """
    causes = [c for c in fit.dictionary.causes if c.position >= 0]
    far = [
        c for c in causes if fit.system.starting_angles(fit.nominal, c.position).any()
    ]
    if 2 * len(far) >= len(causes):  # then the device is what is different
        return ()
    return tuple((c, c.variants[0]) for c in far)


def _turns_need_usual_causes(
    turn_rows: Sequence[TurnRows], best: Set, usual: set[str]
) -> bool:
    """Whether turns are explained by unusual causes, and not by all usual ones.

    Usual causes look less likely about a state that contains unusual ones.
    """
    if usual <= best.keys:
        return False
    unusual = [group.columns for cause, group in best.members if not cause.usual]
    columns = np.concatenate([np.empty(0, int), *unusual])
    return any(
        np.isin(rows.columns[rows.design.any(axis=0)], columns).any()
        for rows in turn_rows
    )
