"""Sets from which a search begins whose states may be far from the nominal one.

The rows are linearised about the nominal state first. An explanation that changes the
state by much may look unlikely there, and is tried about its own state as well.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from fieldcal.core.gravity import G0
from fieldcal.core.samples import GYR
from fieldcal.model import priors, thresholds
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.evidence.gram import Gram
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.search.gauss_newton import GaussNewton
from fieldcal.model.search.restarts import sets_with_restarts
from fieldcal.model.search.selection import Search
from fieldcal.model.search.variations import score_of
from fieldcal.model.system.fitted import estimates_by_column
from fieldcal.model.system.turn_rows import TurnRows
from fieldcal.physics.attitude_step import AttitudeStep


def starting_sets(fit: GaussNewton, search: Search, best: Set) -> Iterator[Set]:
    """Starting sets beside the one from which `best` was found about the nominal state.

    The rows of turns are those of the fit when each set is asked for.
    """
    yield from sets_with_large_turns(search)
    if elsewhere := _positions_elsewhere(fit):
        yield search.sets.evaluate(elsewhere)
    nothing = search.sets.evaluate(())
    if restarts := sets_with_restarts(search.sets, nothing):
        yield max(restarts, key=score_of)
    usual = tuple((c, c.variants[0]) for c in fit.dictionary.causes if c.usual)
    keys = {c.key for c, _ in usual}
    instability = priors.SIZES[list(best.sizes.instability)]
    if (instability.max() > thresholds.LARGE_INSTABILITY and not keys <= best.keys) or (
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


def sets_with_large_turns(search: Search) -> Iterator[Set]:
    """Sets of one position, or of one effect, that turns by a large angle.

    A large angle is not linear: about the stated angle its residuals make it less
    likely than causes with more columns, such as a bias that jumps and whatever makes
    up for the length of the force. It is large if its square shows.
    """
    sets, tried = search.sets, set[str]()
    empty = sets.evaluate(())
    for offer in search.offers.ranked(empty):
        kind = _kind_of_turn(*offer.member)
        if not kind or kind in tried:
            continue
        tried.add(kind)
        turned = search.offers.accept(empty, offer)
        values = estimates_by_column(turned.state, sets.dictionary)
        angles = values[offer.member[1].columns]
        if kind == "effect":
            angles = np.deg2rad(angles)
        if np.abs(angles).max() >= visible_angle(sets.gram):
            yield turned


def _kind_of_turn(cause: Cause, group: Group) -> str:
    """Whether a cause is a turn, in rad of a position or in degrees of an effect."""
    if cause.kind == "position":
        return "position"
    return "effect" if isinstance(group.effect, AttitudeStep) else ""


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
