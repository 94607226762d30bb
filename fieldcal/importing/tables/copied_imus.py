"""IMUs of a file that are no devices of their own: another one's samples, filtered.

A program that writes raw and filtered axes under the same names makes two IMUs of one.
Of two devices the biases differ; a filter keeps them, and follows the noise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

from fieldcal.core.samples import CHANNELS, Array
from fieldcal.importing.units.scales import MIN_ROWS

NEAR = 5.0
"""Standard errors by which the median of what a filter took away is off zero."""

MEDIAN_ERROR = 1.2533 * 1.4826
"""Standard error of a median, in median absolute deviations over the root of n."""

CALM = 6.0
"""Median absolute deviations within which the noise lies, as long as nothing turns."""

SAME = 0.99
"""Steps of a filtered output are smaller than this part of the other's."""

FOLLOWS = 0.6
"""Share of the steps of two sensors that have the same sign: 0.5 by chance, and more
than 0.7 behind a filter that knows no later samples."""


def copied_imus(table: Array, imus: Mapping[str, Mapping[str, int]]) -> dict[str, str]:
    """IMUs that are copies of others, each with what it is a copy of.

    Of two the one with less noise is the filtered one; of two that are the same, the
    second.

    Parameters
    ----------
    table : (n, k) of the first rows
    imus : the column of each channel, by the name of the IMU

    """
    found: dict[str, str] = {}
    for first, second in combinations(imus, 2):
        shared = _own_channels(imus[first], imus[second])
        one, other = (table[:, [imus[i][c] for c in shared]] for i in (first, second))
        if {first, second} & {*found} or not shared or not _is_copied(one, other):
            continue
        # what was written again has other digits at most
        filtered = np.median(_steps(one) / _steps(other)) < SAME
        found[first if filtered else second] = second if filtered else first
    return found


def _own_channels(one: Mapping[str, int], other: Mapping[str, int]) -> list[str]:
    """Channels that both have, each in a column of its own."""
    both = (c for c in CHANNELS if c in one and c in other)
    return [c for c in both if one[c] != other[c]]


def _is_copied(one: Array, other: Array) -> bool:
    """Whether outputs (n, k) are those of the same device, filtered or as they are."""
    known = np.isfinite(one).all(axis=1) & np.isfinite(other).all(axis=1)
    one, other = one[known], other[known]
    if len(one) < MIN_ROWS or not (np.ptp(one, axis=0) > 0).all():
        return False
    away = other - one
    # what a filter holds back of a turn is no noise
    middle, spread = _middle_and_spread(away)
    calm = (np.abs(away - middle) <= CALM * spread).all(axis=1)
    if np.count_nonzero(calm) < MIN_ROWS:
        return False
    middle, spread = _middle_and_spread(away[calm])
    error = MEDIAN_ERROR * spread / np.sqrt(np.count_nonzero(calm))
    if (np.abs(middle) > NEAR * error).any():
        return False
    steps = np.sign(np.diff(one, axis=0) * np.diff(other, axis=0))
    both = np.count_nonzero(steps, axis=0)
    follows = np.count_nonzero(steps > 0, axis=0) > FOLLOWS * np.maximum(both, 1)
    return bool(follows.all())


def _middle_and_spread(values: Array) -> tuple[Array, Array]:
    """Median (k,) of values (n, k), and their median absolute deviation."""
    middle = np.median(values, axis=0)
    return middle, np.median(np.abs(values - middle), axis=0)


def _steps(outputs: Array) -> Array:
    """Usual size (k,) of the steps of outputs (n, k) that change, from row to row."""
    steps = np.abs(np.diff(outputs, axis=0))
    size: Array = np.nanmedian(np.where(steps > 0, steps, np.nan), axis=0)
    return size


def tell_copied(copies: Mapping[str, str]) -> Sequence[str]:
    """Say which IMUs were left out, a sentence each."""
    return [
        f"{name}: has the biases of {of} and follows its noise, so it is the same"
        " device, filtered or written again; left out"
        for name, of in copies.items()
    ]
