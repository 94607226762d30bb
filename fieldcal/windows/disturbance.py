"""Disturbances of a window: push, step and shake, relative to their size by noise.

y_i are the means of m cells, u_k,i their running means over 2^k cells, s_k and a_k the
noise of module `quiet`, l_i a robust straight line through y.

    push     z_k,i = |u_k,i - running mean of l| / s_k                           (1)
    step     z_k,i = |u_k,i+2^k - u_k,i| / (sqrt(2) a_k)                         (2)
    shake    z_k,i = sqrt(2^k) (mean of 2^k of q^(1/3) - median) / spread        (3)

The line l removes the slow drift of a device that warms up, which increases the error
of the mean but is no disturbance. A step tilts the line and may not show in (1), but it
shows in (2). There the drift is subtracted from y only in sections that a line
describes better than a step. A vibration that does not move the device permanently
shows in the short-lag noise q of the cells, whose cube root is nearly normal (Wilson
and Hilferty 1931). Runs in which a channel repeats one value are found too.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fieldcal.core.probability import MAD_TO_SIGMA
from fieldcal.core.samples import Array
from fieldcal.windows.quiet import QuietNoise, running_means

Kind = Literal["push", "step", "shake"]

SHAKE_LEVELS = 4
"""Durations looked for in the short-lag noise: 0.1 s to 0.8 s."""

_HEAVY = 1.3
"""Factor of the spread for low-passed sensors, whose short-lag noise has heavier
tails."""

STUCK_CELLS, STUCK_VALUES = 10, 20
"""Fewest cells and values of a run of one value that noise of one step of the
resolution does not make."""


@dataclass(frozen=True, slots=True)
class DisturbanceStatistic:
    """One kind of disturbance at one duration, at n instants on c channels.

    Attributes
    ----------
    kind : kind of disturbance
    cells : its duration, 2^k cells
    size : (n, c) measured departure, SI
    noise : (c,) its standard deviation by noise, SI
    z : (n, c) departure over spread, (1) to (3)

    """

    kind: Kind
    cells: int
    size: Array
    noise: Array
    z: Array


@dataclass(frozen=True, slots=True)
class LeastSpread:
    """Lower bounds of the spreads of c channels, whatever the window shows.

    Attributes
    ----------
    always : (c,) of means over any duration, SI
    sampled : (c,) of one sample, SI; for a mean it is divided by the root of the number
    number : (c,) samples in a cell

    """

    always: Array
    sampled: Array
    number: Array

    def of_means(self, cells: int) -> Array:
        """Least spread of a mean over so many cells, (c,)."""
        least: Array = np.maximum(self.always, self._random_error(cells))
        return least

    def of_changes(self, cells: int) -> Array:
        """Least spread of the difference of two such neighbouring means, (c,)."""
        least: Array = np.maximum(self.always, np.sqrt(2.0) * self._random_error(cells))
        return least

    def of_roots(self) -> Array:
        """Least spread of the cube root of a cell's short-lag noise, (c,)."""
        drawn = np.cbrt(self.sampled**2) / np.sqrt(np.maximum(self.number, 1.0))
        least: Array = np.maximum(np.cbrt(self.always**2), drawn)
        return least

    def _random_error(self, cells: int) -> Array:
        drawn: Array = self.sampled / np.sqrt(cells * np.maximum(self.number, 1.0))
        return drawn


def pushes(
    about: Array, noise: QuietNoise, least: LeastSpread
) -> list[DisturbanceStatistic]:
    """Deviations of cell means from their line, `about` (m, c), (1)."""
    levels = zip(running_means(about), noise.spread, strict=False)
    return [
        DisturbanceStatistic(
            "push", 2**k, u, s, np.abs(u) / _zero_as_inf(s, least.of_means(2**k))
        )
        for k, (u, s) in enumerate(levels)
    ]


def steps(
    means: Array, noise: QuietNoise, least: LeastSpread
) -> list[DisturbanceStatistic]:
    """Changes between neighbouring running means of `means` (m, c), (2)."""
    levels = zip(running_means(means), np.sqrt(2.0) * noise.allan, strict=False)
    tests = []
    for k, (u, s) in enumerate(levels):
        change = u[2**k :] - u[: -(2**k)]
        spread = _zero_as_inf(s, least.of_changes(2**k))
        tests.append(
            DisturbanceStatistic("step", 2**k, change, s, np.abs(change) / spread)
        )
    return tests


def shakes(
    short: Array, number: Array, least: LeastSpread
) -> list[DisturbanceStatistic]:
    """Excess of the short-lag noise (m, c), a variance, over its usual size, (3).

    `number` (m, c) is the number of differences of each; few of them count less.
    """
    root = np.cbrt(short)
    most = np.maximum(np.median(number, axis=0), 1.0)
    centred = np.sqrt(np.minimum(1.0, number / most)) * (root - np.median(root, axis=0))
    usual = _HEAVY * MAD_TO_SIGMA * np.median(np.abs(centred), axis=0)
    spread = _zero_as_inf(usual, least.of_roots())
    noise = np.sqrt(np.median(short, axis=0))
    levels = zip(
        running_means(centred, SHAKE_LEVELS),
        running_means(short, SHAKE_LEVELS),
        strict=True,
    )
    return [
        DisturbanceStatistic(
            "shake",
            2**k,
            np.sqrt(np.maximum(q, 0.0)),
            noise,
            u * np.sqrt(2.0**k) / spread,
        )
        for k, (u, q) in enumerate(levels)
    ]


def repeats(
    short: Array, number: Array, channels: Iterable[int]
) -> list[tuple[int, int, int]]:
    """Runs of cells in which one of the channels that have noise repeats one value.

    `short`, `number` (m, c) as for `shakes`. Each run is (channel, first cell, one past
    the last).
    """
    runs = []
    for channel in channels:
        same = (short[:, channel] == 0) & (number[:, channel] > 0)
        edges = np.flatnonzero(np.diff(same.astype(int), prepend=0, append=0))
        for first, end in edges.reshape(-1, 2).tolist():
            long = end - first >= STUCK_CELLS
            if long and number[first:end, channel].sum() >= STUCK_VALUES:
                runs.append((int(channel), first, end))
    return runs


def _zero_as_inf(spread: Array, least: Array) -> Array:
    """Spread, at least `least`; infinite, so that nothing is found, where it is 0."""
    bounded = np.maximum(spread, least)
    return np.where(bounded > 0, bounded, np.inf)
