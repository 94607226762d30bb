"""Possible mistakes in the stated set-up of a navigator's runs.

A mistake is modelled as a set-up with a larger uncertainty of what it concerns.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.navigator.run_rows import RunSetup

OFF_DEG = 5.0
"""Size of a mistake of level, azimuth or attitude, 1 sigma: much larger than errors of
setting, and small enough for a linear model."""

SET_DEG = 0.5
"""Error of all attitudes if they are set by hand or the base sways, 1 sigma."""

LEVEL, AZIMUTH, ATTITUDES, SCATTER = "level", "azimuth", "attitudes", "scatter"


def run_mistake_name(r: int) -> str:
    """Name of a mistake of the attitude of run r, counted from 0.

    >>> run_mistake_name(0)
    'run 1'
    """
    return f"run {r + 1}"


def setups_with_mistakes(told: RunSetup) -> Iterator[tuple[str, RunSetup]]:
    """Yield the name of each mistake and the set-up with it.

    Mistakes concern the base, all attitudes or one attitude. With a single run, an
    error of its attitude is an error of the base.
    """
    yield LEVEL, _with_wider_base_sigma(told, np.array([OFF_DEG, 0.0, OFF_DEG]))
    yield AZIMUTH, _with_wider_base_sigma(told, np.array([0.0, OFF_DEG, 0.0]))
    if len(told.attitude_sigmas) == 1:
        return
    yield (
        ATTITUDES,
        replace(
            told, attitude_sigmas=np.maximum(told.attitude_sigmas, np.deg2rad(SET_DEG))
        ),
    )
    for r in range(len(told.attitude_sigmas)):
        own = told.attitude_sigmas.copy()
        own[r] = max(own[r], np.deg2rad(OFF_DEG))
        yield run_mistake_name(r), replace(told, attitude_sigmas=own)


def _with_wider_base_sigma(told: RunSetup, degrees: Array) -> RunSetup:
    return replace(told, base_sigma=np.maximum(told.base_sigma, np.deg2rad(degrees)))
