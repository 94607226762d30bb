"""What an estimate would be with another rate of the Earth in the gyroscopes.

Rates of windows are linear in it, and closures of turns as far as it turns the device
during one, 4e-4 rad in five seconds, is a small angle: its square is 1e-7 rad. So the
rows that a set was fitted to, linearised, say the same of other rates as they would if
these were fitted anew.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import Array
from fieldcal.model.evidence.gram import Gram
from fieldcal.model.evidence.sets import Sets
from fieldcal.model.state import State
from fieldcal.solve.averaging import (
    average_explanations,
    mixture_with_causes,
    select_determined,
)
from fieldcal.solve.estimation import ParameterEstimate
from fieldcal.solve.parameter_set import ParameterSet


@dataclass(frozen=True, slots=True)
class OtherEarthRates:
    """Estimates from the same rows, without uncertainty of the model.

    Attributes
    ----------
    stated : with the rate of the stated latitude
    another : with any rate about the vertical
    none : with none

    """

    stated: ParameterEstimate
    another: ParameterEstimate
    none: ParameterEstimate

    @classmethod
    def of(cls, estimate: ParameterEstimate, nominal: State, base_rate: Array) -> Self:
        """From an estimate with the stated rate.

        `nominal` is the state from which it started, `base_rate` (3,) the rate as far
        as it is known, rad/s.
        """
        known, gram = estimate.parameter_set, estimate.sets.gram
        size = np.array(known.options.earth)
        columns = known.earth + np.arange(3)
        free = known.with_earth_sigma(np.array([size[0], EARTH_RATE, size[2]]))
        bare = known.with_earth_sigma(np.zeros(3))
        at = [known.names.index(name) for name in estimate.names]
        return cls(
            replace(
                estimate, score=estimate.mixture.score,
                covariance=estimate.all_parameters.covariance[np.ix_(at, at)],
            ),
            _estimate(estimate, free, gram, nominal),
            _estimate(estimate, bare, gram.with_known(columns, -base_rate), nominal),
        )  # fmt: skip


def _estimate(
    estimate: ParameterEstimate, parameter_set: ParameterSet, gram: Gram, nominal: State
) -> ParameterEstimate:
    """The estimate of another set by rows that are linearised already."""
    likeliest = parameter_set.explanations[0].members
    mixture = mixture_with_causes(parameter_set, Sets(parameter_set, gram), likeliest)
    every = average_explanations(parameter_set, gram, mixture, nominal, averaged=True)
    names, values, covariance, moved, missing = select_determined(parameter_set, every)
    return replace(
        estimate, parameter_set=parameter_set, all_parameters=every, names=names,
        values=values, covariance=covariance, undetermined=missing, mixture=mixture,
        score=mixture.score, shift_sigmas=moved,
    )  # fmt: skip
