"""One sample in every k that differs from the others by as much throughout a window.

Less the moving mean over a period of k samples, y(i), which takes out what changes
slowly, a window is cut into pieces of whole periods. With the mean of y in each of the
k places of a period, over piece p,

    c_p(s) = k/(k - 1) mean of y in place s,    t(s) = mean c_p(s) / error       (1)

is by how much the samples in place s differ from the others, and its error follows from
how c_p scatters between pieces. That holds for noise of any spectrum, so a sensor that
is sampled twice, filtered or held, and a vibration whose phase runs on, show nothing.
Two devices do that send by turns, one of them k - 1 times as often: also where they
differ by much less than the noise of a sample, and where a part of the samples arrives
in the wrong order.

A steady line of 1/k of the rate gives c(s) a course through all places, in which the
largest explains less than `LEAST_OF_ONE_PLACE` from k = 4 on.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fieldcal.core.samples import Array, Index

PERIODS = range(2, 11)
"""Periods that are tried, in samples: rates of two devices differ tenfold at most."""

PARTS, PIECES_OF_A_PART = 4, 6
"""Parts of a window that are compared, and pieces by whose scatter each is known."""

PIECES = PARTS * PIECES_OF_A_PART

OTHER_PIECES = 29
"""The same, with no divisor in common: a vibration that turns by whole periods from
piece to piece is the same in all of either, and in the others it is not."""

MOST_SAMPLES = 50_000
"""Samples of a window that are looked at."""

LEAST_ERROR = 1e-15
"""Of an output that is zero throughout, m/s^2 or rad/s."""

LEAST_OF_ONE_PLACE = 0.75
"""Share of the squares in all places that the largest explains, of one in k samples. A
line of 1/k gives 0.67 or less; so does any course without one such place."""

STEADY_F = 15.0
"""Ratio of the variance between parts to that inside them, from which a difference is
not steady. With 3 and 20 degrees of freedom, noise exceeds it once in 50 000 times."""

MOST_T = 1e3
"""Largest difference in units of its error, which rounding may make zero."""


class OnePlace(NamedTuple):
    """What samples in one place of a period differ by from all others.

    Attributes
    ----------
    size : (6,) m/s^2 and rad/s; 0 in outputs that have no values
    error : standard error of each, (6,); infinite in those
    steady : whether it is the same throughout the window

    """

    size: Array
    error: Array
    steady: bool

    @property
    def t(self) -> Array:
        """Sizes in units of their errors, (6,)."""
        return np.asarray(np.clip(self.size / self.error, -MOST_T, MOST_T))


@dataclass(frozen=True, slots=True)
class RestOutputs:
    """The outputs that have values in a window at rest, at most `MOST_SAMPLES`.

    Attributes
    ----------
    live : (k,) indices of the outputs
    apart : samples less their means, (n, k) m/s^2 and rad/s
    sums : of the first of them, none to all, (n + 1, k)
    least : least error of each output, (k,)

    """

    live: Index
    apart: Array
    sums: Array
    least: Array

    @classmethod
    def of(cls, six: Array) -> RestOutputs:
        """Of consecutive samples at rest, (n, 6); nan where there is none."""
        live = np.flatnonzero(2 * np.isfinite(six).sum(axis=0) > len(six))
        x = six[:MOST_SAMPLES, live]
        if not (known := np.isfinite(x).all(axis=1)).all():
            x = x[known]
        if not x.size:
            return cls(live[:0], x, x, np.zeros(0))
        apart = np.asfortranarray(x - x.mean(axis=0))
        sums = np.zeros((len(x) + 1, len(live)), order="F")
        np.cumsum(apart, axis=0, out=sums[1:])
        least = np.maximum(np.finfo(float).eps * np.abs(x).max(axis=0), LEAST_ERROR)
        return cls(live, apart, sums, least)


def one_place_of_period(rest: RestOutputs, period: int) -> OnePlace | None:
    """The place of a period of k samples that differs most; None for too few."""
    live, least = rest.live, rest.least
    if len(rest.apart) < period * (OTHER_PIECES + 1) or not len(live):
        return None
    y = _less_moving_mean(rest, period)
    places, others = (_by_place(y, period, n) for n in (PIECES, OTHER_PIECES))
    mean = places.mean(axis=0)
    error = np.maximum(
        places.std(axis=0, ddof=1) / np.sqrt(PIECES),
        others.std(axis=0, ddof=1) / np.sqrt(OTHER_PIECES),
    )
    # in units of one error for all: where the order varies, places have their own
    square = mean**2 / np.maximum((error**2).mean(axis=0), least**2)
    square = square.sum(axis=1)
    place = int(square.argmax())
    steady = _is_steady(places[:, place], least)
    found = OnePlace(np.zeros(6), np.full(6, np.inf), steady)
    if period > 2 and not _is_of_one_place(square - len(live)):
        return found  # a line has as much in other places
    found.size[live] = mean[place]
    found.error[live] = np.maximum(error[place], least)
    return found


def _by_place(y: Array, period: int, pieces: int) -> Array:
    """C of (1) in each of some pieces, (pieces, k, outputs)."""
    each = len(y) // (period * pieces)
    parts = y[: each * period * pieces].reshape(pieces, each, period, -1)
    return np.asarray(parts.mean(axis=1) * period / (period - 1))  # (1)


def _less_moving_mean(rest: RestOutputs, period: int) -> Array:
    """Samples less the mean over a period about each, (n - period, outputs)."""
    mean = rest.sums[period:] - rest.sums[:-period]
    mean /= period
    if not period % 2:
        mean = (mean[1:] + mean[:-1]) / 2
    out: Array = rest.apart[period // 2 :][: len(mean)] - mean
    return out


def _is_of_one_place(square: Array) -> bool:
    """Whether one of the places explains the squares (k,) beyond those of noise."""
    period = len(square)
    return bool(square.max() / (1 - 1 / period) >= LEAST_OF_ONE_PLACE * square.sum())


def _is_steady(pieces: Array, least: Array) -> bool:
    """Whether differences (`PIECES`, outputs) are the same in all parts of a window."""
    parts = pieces.reshape(PARTS, PIECES_OF_A_PART, -1)
    inside = np.maximum(parts.var(axis=1, ddof=1).mean(axis=0), least**2)
    between = PIECES_OF_A_PART * parts.mean(axis=1).var(axis=0, ddof=1)
    return bool((between <= STEADY_F * inside).all())
