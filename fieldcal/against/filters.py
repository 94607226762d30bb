"""Difference of the sensors' filters, which the turns of two recordings show."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fieldcal.against.causes import DecidedCauses
from fieldcal.against.joint import probability_of_difference
from fieldcal.against.result import Difference, Direction, RealAndSimulated
from fieldcal.core.samples import Array
from fieldcal.diagnosis.findings.filters import time_constants
from fieldcal.diagnosis.result import Quantity
from fieldcal.model import thresholds
from fieldcal.model.causes.filtered_turns import FILTERED

DIRECTIONS: dict[tuple[bool, bool], Direction] = {
    (True, False): "left_out", (False, True): "added", (True, True): "resized",
}  # fmt: skip
"""Direction, by whether the recording and the simulator have a filter."""


def filter_difference(found: DecidedCauses) -> Iterator[Difference]:
    """The difference of two filters, by the variances of their impulse responses."""
    both = (found.real, found.sim)
    groups = [w.fit.dictionary.filters for w in both]
    if groups[0] is None or groups[1] is None:
        return
    (one, cov), (two, more) = (
        w.estimate(g.columns[:2]) for w, g in zip(both, groups, strict=True) if g
    )
    typical = groups[0].typical[:2]
    probability = probability_of_difference(one - two, cov + more, typical)
    told = _time_constants(one, cov), _time_constants(two, more)
    names = dict.fromkeys([*told[0], *told[1]])
    if probability < thresholds.NAMED or not names:
        return
    direction = DIRECTIONS[bool(told[0]), bool(told[1])]
    parameters = {n: RealAndSimulated.of(told[0].get(n), told[1].get(n)) for n in names}
    yield Difference(FILTERED, direction, probability, parameters)


def _time_constants(square: Array, covariance: Array) -> dict[str, Quantity]:
    return time_constants(square, np.sqrt(np.diag(covariance)))
