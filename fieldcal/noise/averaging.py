"""How long to average: the error of a mean against its length.

The error of a mean over T is the Allan deviation sigma(T) of the channel's processes:
half of the variance by which the next mean differs, to which both contribute. It falls
as N / sqrt(T) while noise is white, until flicker, random walk or a ramp contribute as
much,

    sigma^2(T) = 2 N^2 / T                                                         (1)

Its minimum is the best that averaging can reach.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.noise.prediction import SizeDraw
from fieldcal.noise.processes import allan_variance

PER_DECADE = 8
LENGTH_TOLERANCE = 0.01
"""Relative tolerance: a recording of 30 s is one sample shorter than 30 s."""


@dataclass(frozen=True, slots=True)
class AveragingError:
    """The error of a mean of one channel.

    Attributes
    ----------
    seconds : (t,) lengths of means, s
    sigma, low, high : (t,) error of such a mean, and its 68 % interval
    best : length with the least error, s: middle, low and high; inf if it is longer
        than the recording
    white_until : length up to which noise is mostly white, s: middle, low and high

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


def averaging_error(
    drawn: tuple[SizeDraw, ...], ramp: float, dt: float, longest: float
) -> AveragingError:
    """Error of means, up to the length of the recording.

    Parameters
    ----------
    drawn : draws of the sizes of the processes
    ramp : units per s
    dt, longest : s between samples, and of the longest stretch

    """
    end = max(longest * (1 + LENGTH_TOLERANCE), 4.0)
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
    return AveragingError(
        seconds, middle, low, high, _middle_low_high(best), _middle_low_high(until)
    )


def _middle_low_high(values: Array) -> tuple[float, float, float]:
    """Middle, low and high of draws, some of which may be infinite."""
    ordered = np.sort(values)
    at = [ordered[int(q * (len(ordered) - 1))] for q in (0.5, 0.16, 0.84)]
    return float(at[0]), float(at[1]), float(at[2])
