"""Slow swings that are no push: they go there and back before and after it as well.

A hand or a base that swings once in some seconds looks like a push in each half period.
What it does during a push is predicted by the samples beside the push: they are fitted
by a level and by one wave, two or three for each output, and continued into it.
Source: model of this project.

>>> import numpy as np
>>> t = np.arange(200) / 50
>>> near = np.sin(2 * np.pi * 0.5 * t)[:, None]
>>> push = (75, 125)
>>> bool(np.ptp(near - swings(near, push, 50.0)[0]) < 0.3)
True
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array

SWING_HZ = np.geomspace(0.2, 2.0, 24)
"""Frequencies of a swing; half a period is as long as a push."""

WAVES = 3
"""Most waves of one output: a hand has several frequencies."""


def swings(near: Array, at: tuple[int, int], rate: float) -> list[Array]:
    """Courses (n, c) of one to `WAVES` waves in each output; none if all are too slow.

    Parameters
    ----------
    near : samples around a push, (n, c); nan where one is missing
    at : first and one past the last sample of the push
    rate : samples in a second

    """
    t = np.arange(len(near)) / rate
    beside = np.ones(len(near), dtype=bool)
    beside[at[0] : at[1]] = False
    phases = 2 * np.pi * np.outer(SWING_HZ[SWING_HZ > rate / len(near)], t)
    waves = np.stack([np.cos(phases), np.sin(phases)], axis=-1)
    if not len(waves):
        return []
    sums = [_sums_of_waves(z, waves, beside & np.isfinite(z)) for z in near.T]
    return [np.column_stack(outputs) for outputs in zip(*sums, strict=True)]


def _sums_of_waves(
    column: Array, waves: Array, told: NDArray[np.bool_]
) -> Iterator[Array]:
    """Level and one to `WAVES` waves (n,), each the one that leaves least where `told`.

    `waves` (k, n, 2) are the cosine and the sine of each frequency.
    """
    design = np.ones((len(column), 1))
    for _ in range(WAVES):
        fits = []
        for wave in waves:
            one = np.hstack([design, wave])
            fit = np.linalg.lstsq(one[told], column[told], rcond=None)[0]
            left = np.square(column[told] - one[told] @ fit).sum()
            fits.append((float(left), one, fit))
        _, design, fit = min(fits, key=lambda tried: tried[0])
        yield design @ fit
