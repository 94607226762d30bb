"""IMUs of a file that are no devices of their own: another one's samples, filtered.

A program that writes raw and filtered axes under the same names makes two IMUs of one.
Of two devices the biases differ; a filter keeps them, and makes its noise of the
other's, whether it knows later samples or not:

    dy[k] = sum over |j| <= K of h[j] dx[k + j] + rest                              (1)

dx, dy steps from row to row of what goes into the filter and comes out of it, K rows.
Of two devices at rest (1) explains nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

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

EXPLAINED = 0.3
"""Part of the variance of dy that (1) explains beyond chance: nothing of two devices,
0.4 behind a median of nine, and nearly all behind linear filters."""

TINY = 1e-300
"""Variance of steps that are none."""

MOST_LAGS, ROWS_EACH, MOST_ROWS = 25, 20, 5000
"""K at most, rows for each h[j] at least, and rows of (1) at most."""


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
    steps = [np.diff(outputs, axis=0) for outputs in (one, other)]
    quiet = _is_calm(steps[0]) & _is_calm(steps[1])
    # what a filter holds back of a turn is no noise
    away = (other - one)[1:][quiet]
    away = away[_is_calm(away)] if len(away) else away
    if len(away) < MIN_ROWS:
        return False
    middle, spread = _middle_and_spread(away)
    error = MEDIAN_ERROR * spread / np.sqrt(len(away))
    if (np.abs(middle) > NEAR * error).any():
        return False
    # of a filter the smaller steps come out
    sizes = [np.nanmedian(np.abs(x[quiet]).mean(axis=0)) for x in steps]
    into, out = steps if sizes[0] >= sizes[1] else steps[::-1]
    return _explains(into, out, quiet) > EXPLAINED


def _is_calm(values: Array) -> NDArray[np.bool_]:
    """Rows (n,) of values (n, k) that lie within their noise."""
    middle, spread = _middle_and_spread(values)
    return np.asarray((np.abs(values - middle) <= CALM * spread).all(axis=1))


def _explains(into: Array, out: Array, quiet: NDArray[np.bool_]) -> float:
    """Part of the variance of steps (n, k) that (1) explains beyond chance, of most.

    Parameters
    ----------
    into, out : steps dx and dy
    quiet : (n,) rows that are used, as far as dx is calm in all of |j| <= K

    """
    lags = min(MOST_LAGS, int(quiet.sum()) // (2 * ROWS_EACH))
    whole = np.all(sliding_window_view(_is_calm(into), 2 * lags + 1), axis=1)
    rows = np.flatnonzero(whole & quiet[lags : len(quiet) - lags])[:MOST_ROWS]
    spare = len(rows) - (2 * lags + 1)
    if spare < MIN_ROWS:
        return 0.0
    found = []
    for dx, dy in zip(into.T, out[lags : len(out) - lags].T, strict=True):
        design = sliding_window_view(dx, 2 * lags + 1)[rows]
        filtered = np.linalg.lstsq(design, dy[rows], rcond=None)[0]
        left = float(((dy[rows] - design @ filtered) ** 2).sum()) / spare
        found.append(1 - left / max(float((dy[rows] ** 2).mean()), TINY))
    return float(np.median(found))


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
