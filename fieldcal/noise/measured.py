"""The measured Allan deviation, from a reduced recording.

    sigma^2(tau) = <(y_k+1 - y_k)^2> / 2          y: means over tau, overlapping     (1)

The squares of all stretches are added. Source: IEEE 952-1997 annex C.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.noise.levels import ReducedStretch, neighbour_differences

MIN_PAIRS = 2
"""Fewest pairs of means in a stretch at an averaging time."""


@dataclass(frozen=True, slots=True)
class MeasuredAllan:
    """Allan deviation of a channel.

    Attributes
    ----------
    tau : (t,) s
    deviation : (t,)
    length : (t,) total length of the stretches used, s

    """

    tau: Array
    deviation: Array
    length: Array


def measured_allan_deviation(
    stretches: Sequence[ReducedStretch], channel: int, per_degree: float = 0.0
) -> MeasuredAllan:
    """Allan deviation of a channel at averaging times a factor of two apart.

    Parameters
    ----------
    stretches : reduced, the thermometer their last column
    channel : which
    per_degree : temperature coefficient, subtracted where means are kept

    """
    sums: dict[int, list[float]] = {}
    for s in stretches:
        for lag, row, number in zip(s.lags, s.squares, s.number, strict=True):
            _add_squares(sums, int(lag), float(row[channel]), float(number), s)
        y = s.means[:, channel] - per_degree * s.means[:, -1]
        lag = 1
        while lag * 2 * MIN_PAIRS <= len(y):
            steps = neighbour_differences(y[:, None], lag)
            _add_squares(sums, lag * s.m, float(np.sum(steps**2)), float(len(steps)), s)
            lag *= 2
    dt = float(np.median([s.dt for s in stretches]))
    lags = sorted(lag for lag in sums if sums[lag][1])
    table = np.array([sums[lag] for lag in lags]).reshape(-1, 3)
    deviation = np.sqrt(table[:, 0] / table[:, 1] / 2)  # (1)
    return MeasuredAllan(np.array(lags) * dt, deviation, table[:, 2])


def _add_squares(
    sums: dict[int, list[float]],
    lag: int,
    squares: float,
    number: float,
    s: ReducedStretch,
) -> None:
    row = sums.setdefault(lag, [0.0, 0.0, 0.0])
    row[0] += squares
    row[1] += number
    row[2] += s.samples * s.dt
