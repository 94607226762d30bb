"""What disturbs a window: a push, a step, a shake, each over its usual size by noise.

y_i are the means of m cells, u_k,i their running means over 2^k cells, s_k and a_k the
noise of module `quiet`, l_i a robust straight line through y.

    push     z_k,i = |u_k,i - running mean of l| / s_k                           (1)
    step     z_k,i = |u_k,i+2^k - u_k,i| / (sqrt(2) a_k)                         (2)
    shake    z_k,i = sqrt(2^k) (mean of 2^k of q^(1/3) - median) / spread        (3)

The line lets the slow drift of a device that warms up pass: it widens the error of the
mean but is no disturbance. A step tilts the line and so hides from (1), but not from
(2), for which such a drift is too slow. What shakes and comes back to where it was
shows in the short-lag noise q of the cells, whose cube root is close to normal (Wilson
and Hilferty 1931).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fieldcal.samples import Array
from fieldcal.windows.quiet import NORMAL, Quiet, running
from fieldcal.windows.trend import line

Kind = Literal["push", "step", "shake"]

SHAKE_LEVELS = 4
"""Durations looked for in the short-lag noise: 0.1 s to 0.8 s."""


@dataclass(frozen=True, slots=True)
class Statistic:
    """One kind of disturbance at one duration, at n instants on c channels.

    Attributes
    ----------
    kind : what is looked for
    cells : its duration
    size : (n, c) what is seen, SI
    noise : (c,) its usual size, SI
    z : (n, c) departure over spread, (1) to (3)

    """

    kind: Kind
    cells: int
    size: Array
    noise: Array
    z: Array


def pushes(means: Array, noise: Quiet, least: Array) -> list[Statistic]:
    """Deviations of cell means (m, c) from the line, (1).

    `least` (c,) is the least that a spread can be, SI.
    """
    levels = zip(running(means - line(means)), noise.spread, strict=False)
    return [
        Statistic("push", 2**k, u, s, np.abs(u) / _no_less(s, least))
        for k, (u, s) in enumerate(levels)
    ]


def steps(means: Array, noise: Quiet, least: Array) -> list[Statistic]:
    """Changes between neighbouring running means, (2)."""
    levels = zip(running(means), np.sqrt(2.0) * noise.allan, strict=False)
    tests = []
    for k, (u, s) in enumerate(levels):
        change = u[2**k :] - u[: -(2**k)]
        tests.append(
            Statistic("step", 2**k, change, s, np.abs(change) / _no_less(s, least))
        )
    return tests


def shakes(short: Array, least: Array) -> list[Statistic]:
    """Excess of the short-lag noise (m, c), a variance, over its usual size, (3)."""
    root = np.cbrt(short)
    centred = root - np.median(root, axis=0)
    usual = np.median(np.abs(centred), axis=0) / NORMAL
    spread = _no_less(usual, np.cbrt(least**2))
    noise = np.sqrt(np.median(short, axis=0))
    sizes = [np.sqrt(np.maximum(q, 0.0)) for q in running(short, SHAKE_LEVELS)]
    return [
        Statistic("shake", 2**k, size, noise, u * np.sqrt(2.0**k) / spread)
        for k, (u, size) in enumerate(
            zip(running(centred, SHAKE_LEVELS), sizes, strict=True)
        )
    ]


def _no_less(spread: Array, least: Array) -> Array:
    """Spread, infinite where there is none: what never varies cannot be judged."""
    bounded = np.maximum(spread, least)
    return np.where(bounded > 0, bounded, np.inf)
