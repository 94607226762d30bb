"""What the factory left in a device of errors that no explanation has.

Numbers are less certain for them. They are as large as the stated grade has them, and
where biases and scale factors show a coarser one, as the rows show.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fieldcal.calibration.grade_shown import GradeShown
from fieldcal.core.factory import WARMING, FactoryErrors
from fieldcal.core.samples import CHANNELS
from fieldcal.diagnosis.prepare import Prepared
from fieldcal.model.causes.cause import Group
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.causes.effect_causes import factory_sizes, of_factory
from fieldcal.model.evidence.of_two_grades import chances_of_coarser
from fieldcal.model.evidence.sets import Set
from fieldcal.model.posterior.model_average import with_groups
from fieldcal.session.description import Description
from fieldcal.session.factory import factory_errors


def left_by_factory(
    dictionary: Dictionary, about: Description, prepared: Prepared
) -> Iterator[Group]:
    """What the factory left, but for what the simulation has already.

    A warm-up is none of it: the search looks for it as for all that time changes.
    """
    known = {term.effect.id for term in prepared.known} | {*WARMING}
    turned = not dictionary.x.oriented.any()
    for one in of_factory(dictionary, factory_errors(about), turned):
        if one.part not in known:
            yield one


def as_good_as_shown(dictionary: Dictionary, best: Set, about: Description) -> None:
    """Let what the factory left be as large as biases and scale factors make likely."""
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
    shows = GradeShown.of(about.grade, names, values, error, about.sent)
    if not shows.because:
        return
    stated, coarser = (factory_errors(about, grade) for grade in (None, shows.grade))
    larger = _resized(dictionary, stated, coarser)
    beside = with_groups(best, larger)
    sizes = {}
    for kind, p in chances_of_coarser(beside, larger, coarser, stated).items():
        each = getattr(stated, kind), getattr(coarser, kind)
        sizes[kind] = float(np.sqrt(np.average(np.square(each), weights=(1 - p, p))))
    dictionary.unfitted = _resized(dictionary, stated, replace(coarser, **sizes))


def _resized(
    dictionary: Dictionary, before: FactoryErrors, now: FactoryErrors
) -> tuple[Group, ...]:
    """What the factory left, of other sizes."""
    was, sizes = (factory_sizes(dictionary.x, left) for left in (before, now))
    return tuple(
        replace(g, typical=g.typical * sizes[g.part] / was[g.part])
        for g in dictionary.unfitted
    )
