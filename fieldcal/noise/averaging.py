"""How long to average: the error of a mean against its length.

The error of a mean over T, as the next mean would show it, is the Allan deviation
sigma(T) of the channel's processes. It falls as N / sqrt(T) while noise is white, and
no longer once flicker, walk or a ramp have as much of it,

    sigma^2(T) = 2 N^2 / T                                                         (1)

Its least is what any averaging reaches.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.noise.prediction import Draw
from fieldcal.noise.processes import allan_variance

PER_DECADE = 8
EDGE = 0.01
"""A recording of 30 s has a sample less, and tells of a mean over 30 s."""


@dataclass(frozen=True, slots=True)
class Averaging:
    """The error of a mean of one channel.

    Attributes
    ----------
    seconds : (t,) lengths of means, s
    sigma, low, high : (t,) error of such a mean, and what 68 of 100 draws have
    best : length with the least error, s: middle, low and high; inf where it is longer
        than the recording tells
    white_until : length from which noise is no longer mostly white, s, likewise

    """

    seconds: Array
    sigma: Array
    low: Array
    high: Array
    best: tuple[float, float, float]
    white_until: tuple[float, float, float]

    def at(self, seconds: float) -> tuple[float, float]:
        """Error of a mean over `seconds`, and its standard deviation."""
        where = np.log(seconds), np.log(self.seconds)
        middle, low, high = (
            float(np.exp(np.interp(*where, np.log(s))))
            for s in (self.sigma, self.low, self.high)
        )
        return middle, (high - low) / 2


def averaging(
    drawn: tuple[Draw, ...], ramp: float, dt: float, longest: float
) -> Averaging:
    """The error of means up to the length of what was recorded.

    Parameters
    ----------
    drawn : sizes of the processes as they may be
    ramp : units per s
    dt, longest : s between samples, and of the longest stretch

    """
    end = max(longest * (1 + EDGE), 4.0)
    count = int(np.log10(end) * PER_DECADE) + 2
    seconds = np.geomspace(1.0, end, count)
    each = np.array([allan_variance(d.terms, d.x, seconds, dt) for d in drawn])
    each += ramp**2 * seconds**2 / 2
    white = np.array([np.exp(d.x[d.terms.index("N")]) for d in drawn])
    least = np.argmin(each, axis=1)
    best = np.where(least == count - 1, np.inf, seconds[least])
    mixed = each > 2 * white[:, None] / seconds  # (1)
    until = np.where(mixed.any(axis=1), seconds[np.argmax(mixed, axis=1)], np.inf)
    low, middle, high = np.sqrt(np.quantile(each, [0.16, 0.5, 0.84], axis=0))
    return Averaging(seconds, middle, low, high, _three(best), _three(until))


def _three(values: Array) -> tuple[float, float, float]:
    """Middle, low and high of draws of which some may be infinite."""
    ordered = np.sort(values)
    at = [ordered[int(q * (len(ordered) - 1))] for q in (0.5, 0.16, 0.84)]
    return float(at[0]), float(at[1]), float(at[2])
