"""Samples of two devices by turns: their means lie apart, and each follows the other.

Let p be the samples' first principal component, in units of each output's standard
deviation. Split where the variance between the two parts is largest, these explain of
the variance of p

    E = s(1 - s) (m_1 - m_0)^2 / var p                                             (1)

with the share s of one part and the means m of both. The noise of outputs in which two
devices do not differ is part of that p. So each output j is then weighted by how it
tells the parts apart,

    p = sum_j x_j (m_1j - m_0j) / var_j                                            (2)

with its variance inside the parts (Fisher's discriminant), and p is split again. One
device at rest has E = 2/pi = 0.64 of normal noise, 0.75 of rounding to steps,
8/pi^2 = 0.81 of a sinusoid. Two devices whose means differ by d standard deviations of
their noise have d^2 / (4 + d^2), which is more than `LEAST_EXPLAINED` from d = 6 on.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array

FEWEST_SAMPLES = 50
"""Samples of which it can be said."""

LEAST_EXPLAINED = 0.9
"""Share of the variance that the two means explain, (1); above that of a sinusoid."""

LEAST_SHARE = 0.1
"""Least share of the samples that come from either device: rates differ tenfold at
most. Single wrong words are rarer."""

LEAST_CHANGES = 0.05
"""Changes from one device to the other, for each sample. Lines come in bursts of a few;
a device that was moved, or sways, changes far more seldom."""

LEAST_STEPS = 2.5
"""Least difference of the means in steps of an output: noise that is smaller than the
rounding makes one device's output jump to and fro by one step, or by two."""

REFINEMENTS = 2
"""Times that outputs are weighted by how they tell the parts apart, (2)."""

LEAST_VARIANCE = 1e-6
"""Least variance inside the parts, as a share of an output's: of one that is rounded
there may be none."""

CLEAR = 2.0
"""Standard deviations of a sample by which an output differs."""

LEAST_OUTPUTS = 2
"""Outputs that differ: a wrong bit concerns one, another device all."""


class TwoMeans(NamedTuple):
    """Means of the samples of two devices; which is which is not known.

    Attributes
    ----------
    one, other : means of the samples of each, (6,) m/s^2 and rad/s; 0 in outputs that
        have no values
    noise : standard deviation of a sample of one device, or the step of an output that
        has less noise than that, (6,); 1 in outputs that have no values
    error : standard deviation of the difference of the means, in units of `noise`

    """

    one: Array
    other: Array
    noise: Array
    error: float

    @property
    def apart(self) -> Array:
        """Difference of the means, (6,) of either sign, m/s^2 and rad/s."""
        return self.one - self.other


def alternating_means(six: Array) -> TwoMeans | None:
    """Find two devices whose samples come by turns; None if it is one device.

    Parameters
    ----------
    six : consecutive samples at rest, (n, 6) m/s^2 and rad/s; nan where there is none

    """
    six = six[np.isfinite(six).any(axis=1)]
    if len(six) < FEWEST_SAMPLES:
        return None
    live = np.isfinite(six).all(axis=0) & (np.ptp(six, axis=0) > 0)
    x = six[:, live]
    if x.shape[1] < LEAST_OUTPUTS:
        return None
    upper = _two_parts((x - x.mean(axis=0)) / x.std(axis=0))
    if upper is None or np.count_nonzero(np.diff(upper)) < LEAST_CHANGES * len(x):
        return None
    one, other = x[upper], x[~upper]
    apart = one.mean(axis=0) - other.mean(axis=0)
    noise = np.sqrt((one.var(axis=0) + other.var(axis=0)) / 2)
    steps = np.array([np.diff(np.unique(column)).min() for column in x.T])
    clear = np.abs(apart) > np.maximum(CLEAR * noise, LEAST_STEPS * steps)
    if np.count_nonzero(clear) < LEAST_OUTPUTS:
        return None
    error = float(np.sqrt(1 / len(one) + 1 / len(other)))
    found = TwoMeans(np.zeros(6), np.zeros(6), np.ones(6), error)
    found.one[live], found.other[live] = one.mean(axis=0), other.mean(axis=0)
    found.noise[live] = np.maximum(noise, steps)
    return found


def _two_parts(z: Array) -> NDArray[np.bool_] | None:
    """Which samples are of the upper part, (1), (2); None if there are no two parts.

    `z` are samples in units of each output's standard deviation, (n, k).
    """
    p = z @ np.linalg.eigh(z.T @ z)[1][:, -1]
    for _ in range(REFINEMENTS):
        upper, _ = _split(p)
        one, other = z[upper], z[~upper]
        inside = np.maximum((one.var(axis=0) + other.var(axis=0)) / 2, LEAST_VARIANCE)
        p = z @ ((one.mean(axis=0) - other.mean(axis=0)) / inside)  # (2)
    upper, explained = _split(p)
    share = upper.mean()
    there = LEAST_SHARE <= share <= 1 - LEAST_SHARE and explained >= LEAST_EXPLAINED
    return upper if there else None


def _split(p: Array) -> tuple[NDArray[np.bool_], float]:
    """Which samples are of the upper part, and the share E of the variance, (1)."""
    sorted_p = np.sort(p - p.mean())
    share = np.arange(1, len(p)) / len(p)
    between = (np.cumsum(sorted_p)[:-1] / len(p)) ** 2 / (share * (1 - share))  # (1)
    best = int(np.argmax(between))
    return p - p.mean() > sorted_p[best], float(between[best] / np.var(p))
