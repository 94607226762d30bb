"""Single samples that are off by one and the same size: a register read as it changed.

A driver that reads the bytes of a register one after the other while the sensor writes
it has the high byte of one value and the low byte of the next. Where these lie on both
sides of a multiple of 256 counts, the value is off by 256 counts q, up or down:

    x_i = v_i ± D,  D = 256 q                                                      (1)

A bit that is read wrongly does the same. The departure of a sample from the median of
the five about it is noise of size s, or D with that noise, up as well as down, and each
register is torn by itself. Knocks and vibration have departures of all sizes, and shake
the axes together. A grid of the output makes departures of a step or two of it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.probability import MAD_TO_SIGMA
from fieldcal.core.samples import Array

ABOUT = 2
"""Samples to either side of one whose median it is compared with."""

BEYOND_NOISE, AS_LARGE = 5.0, 4.0
"""Departure, in s, that noise does not make; and by which departures of one size
differ from it."""

FEWEST, MOST_OTHERS = 20, 0.1
"""Fewest departures of one size that show it, and the part of all that may have
another: of two wrong samples in turn, the median is one."""

FINEST = 128
"""Steps of the grid of an output in such a size, at least."""


class TornValues(NamedTuple):
    """Samples of a sensor that are off by one size.

    Attributes
    ----------
    size : D, in the unit of the samples
    off : (n, 3) what to subtract from the samples: D, -D, or 0

    """

    size: float
    off: Array


def torn_values(
    triad: Array, still: NDArray[np.bool_], steps: Array
) -> TornValues | None:
    """Samples (n, 3) that are off by one size while the device is still; None if none.

    Parameters
    ----------
    triad : samples of a sensor, SI
    still : (n,) samples at rest
    steps : (3,) step of the grid of each output, 0 where it lies on none

    """
    if len(triad) <= 2 * ABOUT:
        return None
    apart = np.zeros_like(triad)
    apart[1:-1] = np.abs(triad[1:-1] - (triad[:-2] + triad[2:]) / 2)
    apart[~still | ~np.isfinite(apart).all(axis=1)] = 0.0
    # this is of a median with four others as well, to a tenth
    noise = MAD_TO_SIGMA * np.array([_median_of_nonzero(axis) for axis in apart.T])
    departs = np.zeros_like(triad)
    for axis in range(3):
        # beside a sample that is off, half of it is seen
        rows = np.flatnonzero(apart[:, axis] > BEYOND_NOISE / 2 * noise[axis])
        rows = rows[(rows >= ABOUT) & (rows < len(triad) - ABOUT)]
        near = triad[np.add.outer(rows, np.arange(-ABOUT, ABOUT + 1)), axis]
        departs[rows, axis] = np.nan_to_num(near[:, ABOUT] - np.median(near, axis=1))
    far = np.abs(departs) > BEYOND_NOISE * noise
    if far.sum() < FEWEST:
        return None
    size = float(np.median(np.abs(departs[far])))
    alike = far & (np.abs(np.abs(departs) - size) < AS_LARGE * noise)
    clear = size > (BEYOND_NOISE + AS_LARGE) * noise[far.any(axis=0)].max()
    if not clear or size < FINEST * steps[far.any(axis=0)].max():
        return None
    if alike.sum() < FEWEST or alike.sum() < (1 - MOST_OTHERS) * far.sum():
        return None
    up, hit = (departs > 0)[alike], alike.any(axis=1)
    if up.all() or not up.any() or alike.sum() > (1 + MOST_OTHERS) * hit.sum():
        return None
    return TornValues(size, np.where(alike, np.sign(departs) * size, 0.0))


def _median_of_nonzero(sizes: Array) -> float:
    """Median of what differs from zero; 0 of nothing."""
    known = sizes[sizes > 0]
    return float(np.median(known)) if len(known) else 0.0
