"""How long windows must be on a base that sways, before anything is recorded."""

from __future__ import annotations

import numpy as np

from fieldcal.core.gravity import G0
from fieldcal.planning.planner import GradeNoise
from fieldcal.windows.cells import CELL
from fieldcal.windows.sway_process import needed_seconds
from fieldcal.windows.sway_waves import SwayWaves

SWAYS_BY = float(np.deg2rad(1.0))
"""Assumed amplitude of the swaying, rad."""


def window_seconds_needed(hz: float, grade: GradeNoise) -> float:
    """Length of windows for which no mean is much more uncertain than at rest, s.

    Parameters
    ----------
    hz : frequency of the swaying, one wave of `SWAYS_BY`
    grade : noise of the device; a triad whose white noise is nan does not count

    """
    amplitude = np.repeat([G0, 2 * np.pi * hz], 3) * SWAYS_BY
    white = np.repeat([grade.acc_white, grade.gyr_white], 3) ** 2 / CELL
    none, whole = np.zeros(6), float(1 / hz)
    return needed_seconds(
        SwayWaves(
            np.array([hz]), 0.0, amplitude[None], np.zeros((1, 6)),
            np.array([0.0, -G0, 0.0]), none[:3], none, white, CELL, (0.0, whole),
        )
    )  # fmt: skip
