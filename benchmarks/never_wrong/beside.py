"""A second device of one make, heard in one stream under the names of the first.

Written apart from everything that estimates. Both feel the same, and the second puts
out one sample while the first puts out `every`, `late` periods of the first behind one
of them. Two neighbours of unlike devices come in exchanged order now and then; the
times are then those of arrival.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from benchmarks.never_wrong.device import Device

Floats = NDArray[np.float64]
Outputs = tuple[Floats, Floats, Floats]
"""Times (n,) s, accelerations and rates (n, 3)."""


@dataclass(frozen=True)
class Beside:
    """The second device, and how its samples come between those of the first.

    Attributes
    ----------
    acc_bias, acc_scale, gyr_bias, gyr_scale : (3,) of the second device
    device : what else it has
    turned : rad about each axis by which it is mounted otherwise than the first
    every : samples of the first for each of the second
    late : periods of the first that it is behind one of them, 0 to 1
    exchanged : share of its samples that come before the one which they follow
    counted : whether times are counted on arrival, evenly, and not each device's own

    """

    acc_bias: Floats
    acc_scale: Floats
    gyr_bias: Floats
    gyr_scale: Floats
    device: Device = field(repr=False)
    turned: tuple[float, float, float]
    every: int
    late: float
    exchanged: float
    counted: bool


def merged(
    first: Outputs, second: Outputs, beside: Beside, rng: np.random.Generator
) -> Outputs:
    """One stream of the samples of both, which were taken at the same times."""
    t = first[0]
    some = np.arange(int(rng.integers(beside.every)), len(t), beside.every)
    behind = t[some] + beside.late * (t[1] - t[0])
    times = np.concatenate([t, behind])
    acc, gyr = (np.vstack([a, b[some]]) for a, b in zip(first[1:], second[1:],
                                                        strict=True))  # fmt: skip
    order = np.argsort(times, kind="stable")
    times = times[order]
    at = np.flatnonzero(order >= len(t))
    at = at[(rng.random(len(at)) < beside.exchanged) & (at > 0)]
    order[at], order[at - 1] = order[at - 1], order[at]
    if beside.counted:
        times = np.linspace(times[0], times[-1], len(times))
    return times, acc[order], gyr[order]
