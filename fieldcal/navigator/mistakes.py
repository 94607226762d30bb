"""What may be wrong with the set-up of a navigator's runs.

Each mistake is a set-up in which something is known no better than after one.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.navigator.run_rows import Setup

OFF_DEG = 5.0
"""What level, azimuth and attitudes may be wrong by where they were not as told, 1
sigma: a mistake of one's own, and still small enough for what is linear."""

SET_DEG = 0.5
"""What all attitudes may be wrong by where they are set by hand, or while the base
sways, 1 sigma."""

LEVEL, AZIMUTH, ATTITUDES, SCATTER = "level", "azimuth", "attitudes", "scatter"


def run_name(r: int) -> str:
    """Name of the mistake of an attitude, by the place of its run from 0.

    >>> run_name(0)
    'run 1'
    """
    return f"run {r + 1}"


def mistakes(told: Setup) -> Iterator[tuple[str, Setup]]:
    """Name of each, and the set-up with it: of the base, of all attitudes, and of one.

    Of one run alone, its attitude and the base are the same.
    """
    yield LEVEL, _wider(told, np.array([OFF_DEG, 0.0, OFF_DEG]))
    yield AZIMUTH, _wider(told, np.array([0.0, OFF_DEG, 0.0]))
    if len(told.own) == 1:
        return
    yield ATTITUDES, replace(told, own=np.maximum(told.own, np.deg2rad(SET_DEG)))
    for r in range(len(told.own)):
        own = told.own.copy()
        own[r] = max(own[r], np.deg2rad(OFF_DEG))
        yield run_name(r), replace(told, own=own)


def _wider(told: Setup, degrees: Array) -> Setup:
    return replace(told, common=np.maximum(told.common, np.deg2rad(degrees)))
