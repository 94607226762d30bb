"""Filters of the sensors, as the turns between known positions show them.

A turn shows the variance v of an impulse response, (1) of `filtered_turns`. A low-pass
of first order with tau^2 = v has the same variance, so the filter is reported as one:
tau = sqrt(v), and the sigma of tau is that of v over 2 tau.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fieldcal.core.probability import probability_of_log_odds
from fieldcal.core.samples import Array
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.result import FoundEffect, Quantity
from fieldcal.effects import catalogue
from fieldcal.model import thresholds
from fieldcal.model.causes.filtered_turns import FILTERED


def found_filters(explanation: Explanation) -> Iterator[FoundEffect]:
    """The filter, if it is more likely present than not."""
    group = explanation.dictionary.filters
    if group is None:
        return
    chance = catalogue()[FILTERED].chance(explanation.dictionary.x)
    rise = explanation.evidence_gain(group.columns.tolist())
    odds = rise + np.log(chance) - np.log1p(-chance)
    probability = float(probability_of_log_odds(odds))
    state = explanation.best.set.state
    at = [int(np.flatnonzero(state.columns == c)[0]) for c in group.columns[:2]]
    constants = time_constants(state.estimate[at], np.sqrt(np.diag(state.inverse)[at]))
    if probability >= thresholds.NAMED and constants:
        evidence = {"log_evidence": rise}
        yield FoundEffect(
            FILTERED, constants, evidence=evidence, probability=probability
        )


def time_constants(square: Array, sigma: Array) -> dict[str, Quantity]:
    """Time constants of the triads whose filter is significant.

    Parameters
    ----------
    square, sigma : (2,) v of accelerometers and gyroscopes, s^2

    """
    out = {}
    params = catalogue()[FILTERED].params
    for param, v, s in zip(params, square.tolist(), sigma.tolist(), strict=True):
        if v > thresholds.STANDS_OUT * s:
            tau = v**0.5
            out[param.name] = Quantity(tau, s / (2 * tau), param.unit)
    return out
