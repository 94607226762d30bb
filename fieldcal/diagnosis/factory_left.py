"""Errors left by the factory calibration that the best set does not contain.

They are not fitted, but they widen every uncertainty. Their typical sizes are those of
the stated grade. Where biases and scale factors show a coarser grade, sizes are means
over both grades, weighted by their probability.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fieldcal.calibration.grade_evidence import GradeShown
from fieldcal.core.factory import WARMING_EFFECTS, FactoryErrors
from fieldcal.core.grade import Grade
from fieldcal.core.samples import CHANNELS
from fieldcal.diagnosis.prepare import PreparedRecording
from fieldcal.model.causes.cause import Group
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.causes.factory_groups import factory_groups, factory_sizes
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.unfitted_groups import (
    chances_of_coarser,
    eliminate_with,
    groups_not_in,
)
from fieldcal.session.description import Description
from fieldcal.session.factory import factory_errors


def factory_error_groups(
    dictionary: Dictionary, about: Description, prepared: PreparedRecording
) -> Iterator[Group]:
    """Columns of the factory errors that the simulation does not have already.

    The warm-up is not among them: the search has a cause for it.
    """
    known = {term.effect.id for term in prepared.known} | {*WARMING_EFFECTS}
    turned = not dictionary.x.oriented.any()
    for group in factory_groups(dictionary, factory_errors(about), turned):
        if group.part not in known:
            yield group


def enlarge_to_shown_grade(
    dictionary: Dictionary, best: Set, about: Description
) -> Grade:
    """Enlarge the factory errors to the grade that bias and scale factor show.

    Returns that grade.
    """
    state, nominal = best.state, about.nominal
    sigma = np.sqrt(np.diag(state.inverse))
    names: list[str] = []
    found: list[tuple[float, float]] = []
    for kind, first in (("bias", dictionary.bias), ("scale", dictionary.scale)):
        for c, channel in enumerate(CHANNELS):
            group = f"{'acc' if c < 3 else 'gyr'}_{kind}"
            for at in np.flatnonzero(state.columns == first + c):
                names.append(f"{group}.{channel[-1]}")
                value = nominal[group][c % 3] + state.estimate[at]
                found.append((float(value), float(sigma[at])))
    values, error = np.array(found).reshape(-1, 2).T
    shows = GradeShown.of(about.grade, names, values, error, about.nominal_as_sent)
    if not shows.because:
        return shows.grade
    stated, coarser = (factory_errors(about, grade) for grade in (None, shows.grade))
    larger = _groups_with_sizes(dictionary, stated, coarser)
    beside = eliminate_with(best, groups_not_in(best, larger))
    sizes = {}
    for kind, p in chances_of_coarser(beside, larger, coarser, stated).items():
        each = getattr(stated, kind), getattr(coarser, kind)
        sizes[kind] = float(np.sqrt(np.average(np.square(each), weights=(1 - p, p))))
    dictionary.unfitted = _groups_with_sizes(
        dictionary, stated, replace(coarser, **sizes)
    )
    return shows.grade


def _groups_with_sizes(
    dictionary: Dictionary, before: FactoryErrors, now: FactoryErrors
) -> tuple[Group, ...]:
    """The groups of the factory errors, with their sizes changed."""
    was, sizes = (factory_sizes(dictionary.x, left) for left in (before, now))
    return tuple(
        replace(g, typical=g.typical * sizes[g.part] / was[g.part])
        for g in dictionary.unfitted
    )
