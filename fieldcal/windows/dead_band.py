"""Dead bands: outputs that the device sets to zero as long as they are small.

An output has a dead band d, m/s^2 or rad/s, if it is often zero, has no other value
below d in size, and has values just above d. The last condition distinguishes a dead
band from rounding to a grid of step d, whose next value is 2 d. The axes of a sensor go
through the same program: those that are often zero show their band together, also where
each turns too quickly to have values just above d. A mean of less than 2 d
has a standard error of at most d / sqrt(3), whatever part of its samples was set to
zero.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import ACC, CHANNELS, GYR, Array, Block
from fieldcal.core.sentences import join_words

MIN_SAMPLES = 2
"""Fewest zeros of a dead band, and fewest values right beyond it."""

BEYOND = (1.1, 1.9)
"""Range of the values just above a dead band, in units of d. A grid of step d has no
values there, even with small rounding errors of its own."""


def dead_bands(block: Block) -> Array:
    """Size below which each output is zero, (6,) m/s^2 and rad/s; 0 without a band.

    Samples that are zero on all six channels were lost, and are ignored. So are those
    of accelerometers that are zero on all axes: at rest they feel gravity.

    >>> swings = np.sin(np.arange(200.0))[:, None] * [1.0, 2.0, 3.0]
    >>> held = np.where(np.abs(swings) < 0.2, 0.0, swings)
    >>> block = Block.of(np.arange(200.0), swings, held)
    >>> dead_bands(block).round(1).tolist()
    [0.0, 0.0, 0.0, 0.2, 0.2, 0.2]
    """
    bands = np.concatenate([_bands_of_sensor(s) for s in (block.acc, block.gyr)])
    if bands.any():
        felt = (block.acc != 0).any(axis=1)
        received = felt | (block.gyr != 0).any(axis=1)
        zeros = [(t == 0).sum(axis=0) for t in (block.acc[felt], block.gyr[received])]
        bands[np.concatenate(zeros) < MIN_SAMPLES] = 0.0
    return bands


def _bands_of_sensor(triad: Array) -> Array:
    """Size of the value nearest to zero of each axis that may have a band, (3,)."""
    bands = np.array([_nearest_value(axis) for axis in triad.T])
    often = (triad == 0).sum(axis=0) >= MIN_SAMPLES
    together = _nearest_value(triad[:, often].ravel()) if often.any() else 0.0
    return np.where(often & (bands == 0), together, bands)


def _nearest_value(values: Array) -> float:
    """Size of the value nearest to zero, if an output (n,) may have a band; else 0."""
    if np.count_nonzero(values == 0) < MIN_SAMPLES:
        return 0.0
    size = np.abs(values)
    least = float(size.min(where=size > 0, initial=np.inf))
    first, last = (factor * least for factor in BEYOND)
    beyond = np.count_nonzero((size > first) & (size < last))
    return least if beyond >= MIN_SAMPLES else 0.0


def error_of_means(mean: Array, band: Array) -> Array:
    """Standard deviation of means (n, c) whose samples may be in the bands (c,).

    >>> error_of_means(np.array([[0.0], [0.3], [0.5]]), np.array([0.2])).round(3)
    array([[0.115],
           [0.115],
           [0.   ]])
    """
    near = np.abs(np.nan_to_num(mean)) < 2 * band
    out: Array = np.where(near, band / np.sqrt(3), 0.0)
    return out


def dead_band_messages(block: Block, means: Array) -> Iterator[str]:
    """Sentences about the bands that hide what windows measured; `means` are (n, 6)."""
    band = dead_bands(block)
    hidden: NDArray[np.bool_] = np.any(error_of_means(means, band) > 0, axis=0)
    for triad, unit in ((ACC, "m/s²"), (GYR, "rad/s")):
        names = [n for n, h in zip(CHANNELS[triad], hidden[triad], strict=True) if h]
        if names:
            yield (
                f"{join_words(names)} {'is' if len(names) == 1 else 'are'} zero where"
                f" less than {band[triad].max():.2g} {unit} is measured (a dead band):"
                " what that hides is in the uncertainties; switch it off in the device"
            )
