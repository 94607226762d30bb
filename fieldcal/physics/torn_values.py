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

from fieldcal.core.probability import MAD_TO_SIGMA
from fieldcal.core.samples import Array, Index, Mask

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

SAMPLES_AT_ONCE = 1 << 14
"""Samples whose departures are computed together: they stay in the cache."""


class TornValues(NamedTuple):
    """Samples of a sensor that are off by one size.

    Attributes
    ----------
    size : D, in the unit of the samples
    off : (n, 3) what to subtract from the samples: D, -D, or 0

    """

    size: float
    off: Array


def torn_values(triad: Array, still: Mask, steps: Array) -> TornValues | None:
    """Samples (n, 3) that are off by one size while the device is still; None if none.

    Parameters
    ----------
    triad : samples of a sensor, SI
    still : (n,) samples at rest
    steps : (3,) step of the grid of each output, 0 where it lies on none

    """
    if len(triad) <= 2 * ABOUT:
        return None
    known = _known(triad, still)
    found = [_Departures.of(axis, known) for axis in triad.T]
    many = [len(axis.rows) for axis in found]
    if sum(many) < FEWEST:
        return None
    departs = np.concatenate([axis.sizes for axis in found])
    noise = np.array([axis.noise for axis in found])
    size = float(np.median(np.abs(departs)))
    alike = np.abs(np.abs(departs) - size) < AS_LARGE * np.repeat(noise, many)
    far = np.array(many) > 0
    clear = size > (BEYOND_NOISE + AS_LARGE) * noise[far].max()
    if not clear or size < FINEST * steps[far].max():
        return None
    if alike.sum() < FEWEST or alike.sum() < (1 - MOST_OTHERS) * len(departs):
        return None
    rows = np.concatenate([axis.rows for axis in found])[alike]
    up, hit = (departs > 0)[alike], len(np.unique(rows))
    if up.all() or not up.any() or alike.sum() > (1 + MOST_OTHERS) * hit:
        return None
    off = np.zeros_like(triad)
    off[rows, np.repeat(np.arange(3), many)[alike]] = np.where(up, size, -size)
    return TornValues(size, off)


class _Departures(NamedTuple):
    """Departures of single samples of an output from those about them.

    Attributes
    ----------
    rows, sizes : (k,) samples that depart further than by noise, and by how much
    noise : s

    """

    rows: Index
    sizes: Array
    noise: float

    @classmethod
    def of(cls, values: Array, known: Mask) -> _Departures:
        """Those of the samples (n,) of which something is known."""
        apart = np.zeros_like(values)
        for first in range(1, len(values) - 1, SAMPLES_AT_ONCE):
            last = min(first + SAMPLES_AT_ONCE, len(values) - 1)
            mean = (values[first - 1 : last - 1] + values[first + 1 : last + 1]) / 2
            np.abs(values[first:last] - mean, out=apart[first:last])
        apart[~known] = 0.0
        # this is of a median with four others as well, to a tenth
        noise = MAD_TO_SIGMA * _median_of_nonzero(apart)
        # beside a sample that is off, half of it is seen
        rows = np.flatnonzero(apart > BEYOND_NOISE / 2 * noise)
        rows = rows[(rows >= ABOUT) & (rows < len(values) - ABOUT)]
        near = values[np.add.outer(rows, np.arange(-ABOUT, ABOUT + 1))]
        sizes = np.nan_to_num(near[:, ABOUT] - np.median(near, axis=1))
        far = np.abs(sizes) > BEYOND_NOISE * noise
        return cls(rows[far], sizes[far], noise)


def _known(triad: Array, still: Mask) -> Mask:
    """Samples at rest that are known on all axes, and those beside them, (n,)."""
    whole: Mask = np.all(np.isfinite(triad), axis=1)
    known = still & whole
    known[1:] &= whole[:-1]
    known[:-1] &= whole[1:]
    return known


def _median_of_nonzero(sizes: Array) -> float:
    """Median of what differs from zero; 0 of nothing."""
    known = sizes[sizes > 0]
    return float(np.median(known, overwrite_input=True)) if len(known) else 0.0
