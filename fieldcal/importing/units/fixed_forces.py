"""Accelerations that do not turn with the device: a filter turned them to the earth.

    a = (0, 0, g) in every row, whatever turns the gyroscopes tell

No unit of the rates explains them, though the smallest comes nearest to it.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.importing.units.gravity_size import GravityReading
from fieldcal.importing.units.rate_size import TURNED, TurnSides, lagged_sums

STEADY, OF_ROWS = 0.05, 0.9
"""Part by which |a| differs from what is usual, in that share of the rows: what flies
or drives feels more."""

ACROSS = 0.5
"""Part of the turns that is about level axes, which gravity turns by."""

SHOWN, FAR = 2.0, 5.0
"""Times that turns are larger than what accelerometers show, which have noise besides,
and than the noise of the rates makes."""

LEAST_RAD = 0.003
"""Turn within half a second that is looked at: a line in the rates makes less."""

TO_SIGMA = 0.954
"""Median of the differences of white noise from sample to sample, over its sigma."""


def forces_are_fixed(t: Array, acc: Array, gyr: Array, gravity: GravityReading) -> bool:
    """Whether rates tell turns that accelerations do not show.

    Slow drifts of rates at rest are none: a half second is compared with the next.

    Parameters
    ----------
    t : (n,) s
    acc : (n, 3) in numbers of the file
    gyr : (n, 3) rad/s
    gravity : what the accelerometers read at rest

    """
    sides = TurnSides.of(t, acc, gyr, gravity)
    if sides is None or len(sides.left) < 4 * sides.lag:
        return False
    if sides.moved >= TURNED**2 * sides.lag:
        return False
    length = np.linalg.norm(sides.up, axis=1)
    away = np.abs(length / max(float(np.median(length)), 0.1) - 1)
    if np.quantile(away, OF_ROWS) > STEADY:
        return False
    said, shown, angle = (_changes(x, sides.lag)
                          for x in (sides.right, sides.left, sides.angles))  # fmt: skip
    noise = np.nanmedian(np.abs(np.diff(sides.gyr, axis=0)), axis=0) / TO_SIGMA
    step = float(np.nanmedian(sides.steps))
    makes = float(np.linalg.norm(noise)) * step * np.sqrt(sides.lag)
    turns = said > max(SHOWN * shown, FAR * makes, LEAST_RAD)
    return bool(turns and said > ACROSS * angle)


def _changes(turns: Array, lag: int) -> float:
    """Rms change of turns (n, 3) from one time to the next, less of their noise."""
    mean = lagged_sums(turns, many := max(lag // 2, 1)) / many
    return float(np.sqrt(((mean[lag:] - mean[:-lag]) ** 2).sum(axis=1).mean()))
