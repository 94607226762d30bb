"""The most probable size of a group between the sizes of the grid."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model import priors, resolutions, tolerances
from fieldcal.model.evidence.eliminated import Eliminated, gains_from_eigenvalues
from fieldcal.model.evidence.sizing import LOG_DENSITY, LOG_SIZE_STEP, gain_terms


def most_probable_size(state: Eliminated, at: Index, v: float) -> tuple[float, float]:
    """Most probable size of a group, and standard uncertainty of its logarithm.

    `at` are the indices of its columns in the state, `v` its size there.
    """
    strength, power = gain_terms(state, at, v)
    near = v * np.exp(
        np.linspace(-LOG_SIZE_STEP, LOG_SIZE_STEP, resolutions.REFINED_SIZES)
    )
    before = np.interp(np.log(near), np.log(priors.SIZES), LOG_DENSITY)
    best = float(
        near[np.argmax(gains_from_eigenvalues(strength, power, near) + before)]
    )
    info = np.maximum(_information(strength, best), tolerances.MIN_SIZE_INFORMATION)
    return best, float(info**-0.5)


def most_probable_axis_size(
    state: Eliminated, at: Index, v: float, triad: tuple[float, float]
) -> tuple[float, float]:
    """The same for a single axis of a triad that has the size v in the state.

    The sizes of the axes differ by `priors.AXES_LOG_SPREAD`, ln, about that of the
    triad; `triad` is the result of `most_probable_size` for the triad.
    """
    strength, power = gain_terms(state, at, v)
    middle, middle_sigma = triad
    distance = np.linspace(-4.0, 4.0, resolutions.REFINED_SIZES)
    near = middle * np.exp(priors.AXES_LOG_SPREAD * distance)
    top = int(
        np.argmax(gains_from_eigenvalues(strength, power, near) - 0.5 * distance**2)
    )
    best = float(near[top])
    prior_info = priors.AXES_LOG_SPREAD**-2
    info = prior_info + _information(strength, best)
    return best, float(np.hypot(info**-0.5, prior_info / info * middle_sigma))


def _information(strength: Array, v: float) -> float:
    """Information on ln v: twice the sum of squares of lambda v^2 / (1 + lambda v^2).

    `strength` (k,) are lambda of (2) of `eliminated`.
    """
    share = v**2 * strength / (1 + v**2 * strength)
    return 2 * float((share**2).sum())
