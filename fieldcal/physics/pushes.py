"""Stretches of samples far beyond the usual spread of a window.

They are found in single samples, and in means over m and 4 m samples, where m samples
are a tenth of a second. The usual spread is that of the noise, or the spread of the
whole window if that is larger. Units: standard deviations of the noise of a sample.
Source: model of this project.

>>> import numpy as np
>>> quiet = np.random.default_rng(1).standard_normal((1000, 1))
>>> quiet[400:420] += 7.0
>>> [(int(a), int(b)) for a, b in disturbed_stretches(quiet, 10)]
[(400, 420)]
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.probability import MAD_TO_SIGMA
from fieldcal.core.samples import Array, runs_of_true

LOUD_SAMPLE_SIGMAS = 6.5
"""A single sample, in standard deviations."""

STRETCH_SAMPLE_SIGMAS = 4.0
"""A sample that belongs to a stretch found by its mean."""

LOUD_MEAN_SIGMAS = 6.0
"""The mean of a short stretch, in standard deviations."""

SHAKEN_RATIO, SHAKEN_TAIL = 1.5, 1.6
"""Spread beyond the noise that a machine or a hand makes, and how far its tails go at
least: what a nonlinear sensor makes of it goes further to one side."""

TAIL_QUANTILES = (0.9, 0.95)
"""Shares of the values that tell how a tail goes on, beyond what a bump takes up."""

TAIL_CHANCE = 1e-4
"""Windows in which what shakes them throughout goes further than is told from them."""

MIN_SAMPLES = 20
"""Samples that tell what is usual in them."""

MAX_SPREAD_VALUES = 50_000
"""Values that tell the usual spread to half a percent."""


@dataclass(frozen=True, slots=True)
class UsualSpread:
    """Usual spread of the outputs in a window, in standard deviations of noise.

    Attributes
    ----------
    sample : (c,) spread of a sample
    tail : (c,) how much further than a normal law of that spread its tails go
    means : (c,) spread of the mean over a stretch, by the samples in it

    """

    sample: Array
    tail: Array
    means: Mapping[int, Array]

    @classmethod
    def of(cls, z: Array, m: int) -> UsualSpread:
        """Of outputs (n, c) without slow part; `m` as in `disturbed_stretches`."""
        sample = usual_spread(z)
        tail, shaken = np.ones(z.shape[1]), sample > SHAKEN_RATIO
        if shaken.any():
            far = _tails(z[:, shaken], sample[shaken])
            tail[shaken] = np.maximum(far, SHAKEN_TAIL)
        means = {width: np.ones(z.shape[1]) for width in _widths(len(z), m)}
        for c, column in enumerate(z.T):
            one = running_means(column / (sample[c] * tail[c]), list(means))
            for (width, spread), mean in zip(means.items(), one, strict=True):
                spread[c] = _usual_mean(mean, width)
        return cls(sample, tail, means)

    def no_less_than(self, z: Array, m: int) -> UsualSpread:
        """The larger of this spread and that of other outputs (n, c).

        Unchanged if there are too few samples.
        """
        if len(z) < MIN_SAMPLES:
            return self
        other = UsualSpread.of(z, m)
        wide = {w: np.fmax(s, other.means.get(w, s)) for w, s in self.means.items()}
        return UsualSpread(
            np.maximum(self.sample, other.sample),
            np.maximum(self.tail, other.tail),
            wide,
        )


def disturbed_stretches(
    z: Array, m: int, beside: UsualSpread | None = None
) -> NDArray[np.intp]:
    """Stretches far beyond the usual spread, (k, 2) first and one past the last sample.

    `z` is (n, c) in standard deviations, without its slow part; `m` the samples of the
    shortest mean; `beside` the usual spread, if it is not that of `z`.
    """
    there = beside or UsualSpread.of(z, m)
    scale = there.sample * there.tail
    # channel by channel: an hour of samples need not be in memory once more
    size = np.zeros(len(z))
    for column, one in zip(z.T, scale, strict=True):
        np.maximum(size, np.abs(column) / one, out=size)
    loud = size > LOUD_SAMPLE_SIGMAS
    alone = _isolated_outliers(size)
    widths = _widths(len(z), m)
    peaks = [np.zeros(len(z) - width + 1) for width in widths]
    for c, column in enumerate(z.T):
        usual = column / scale[c]
        # a byte decoded wrongly is no push: without it, what of the mean is left
        usual[alone] = 0.0
        means = running_means(usual, widths)
        for width, peak, mean in zip(widths, peaks, means, strict=True):
            mean /= there.means[width][c]
            np.maximum(peak, mean, out=peak)
    for width, peak in zip(widths, peaks, strict=True):
        for first, last in runs_of_true(peak > LOUD_MEAN_SIGMAS):
            at = first + int(np.argmax(peak[first:last]))
            loud[at : at + width] = True
    found = _close_gaps(runs_of_true(loud), 2 * m)
    return np.array([_trim(size, a, b) for a, b in found])


def _widths(n: int, m: int) -> list[int]:
    """Lengths of the means, in samples, for n samples."""
    return [width for width in (m, 4 * m) if 2 <= width < n]


def _isolated_outliers(size: Array) -> NDArray[np.bool_]:
    """Single samples beyond noise between usual ones, by their deviations (n,).

    >>> _isolated_outliers(np.array([0.1, 90.0, 0.3, 0.2, 8.0, 9.0, 0.4])).nonzero()
    (array([1]),)
    """
    calm = np.concatenate([[True], size <= STRETCH_SAMPLE_SIGMAS, [True]])
    alone: NDArray[np.bool_] = (size > LOUD_SAMPLE_SIGMAS) & calm[:-2] & calm[2:]
    return alone


def running_means(column: Array, widths: Sequence[int]) -> Iterator[Array]:
    """Means over so many samples, in those of noise, (n - width + 1,) of each width.

    >>> [mean.tolist() for mean in running_means(np.array([1.0, 3.0, -5.0]), (1, 2))]
    [[1.0, 3.0, 5.0], [2.82842712474619, 1.414213562373095]]
    """
    total = np.zeros(len(column) + 1)
    np.cumsum(column, out=total[1:])
    for width in widths:
        mean: Array = total[width:] - total[:-width]
        np.abs(mean, out=mean)
        mean /= np.sqrt(width)
        yield mean


def _usual_mean(mean: Array, width: int) -> float:
    """Spread of means over `width` samples, without those around the largest one."""
    at = int(np.argmax(mean))
    first, last = max(at - width + 1, 0), min(at + width, len(mean))
    left = len(mean) - (last - first)
    if left < width:
        return np.inf
    step = _thinned(left)
    # every so many of those that are left, counted across what is left out
    some = np.concatenate([mean[:first:step], mean[last + -first % step :: step]])
    return float(_middle_half(some[None])[0])


def usual_spread(z: Array) -> Array:
    """Spread of each column by its middle half, at least that of the noise, (c,).

    >>> usual_spread(np.array([[0.0], [3.0], [-3.0], [3.0], [-3.0], [90.0]])).round(2)
    array([4.45])
    """
    return _middle_half(np.abs(z[:: _thinned(len(z))].T, order="C"))


def _thinned(size: int) -> int:
    """Values of so many of which one is looked at."""
    return max(size // MAX_SPREAD_VALUES, 1)


def _middle_half(sizes: Array) -> Array:
    """Spread by the middle half of values without sign, of each row, at least 1."""
    spread: Array = MAD_TO_SIGMA * np.median(sizes, axis=1)
    return np.maximum(spread, 1.0)


def _tails(z: Array, spread: Array) -> Array:
    """How much further each column may go than a normal law of that spread, (c,).

    The tail is an exponential one, as of the square that a nonlinear sensor adds to a
    vibration; that of a normal law is shorter. It is that of the third of the window in
    which it is shortest: a bump is not in all of them.

    >>> z = np.random.default_rng(1).standard_normal((10_000, 2))
    >>> z[:, 1] = z[:, 1] ** 2 - 1.0
    >>> z[2000:5000, 0] += 50.0
    >>> _tails(z, np.array([1.0, 1.1])).round(1)
    array([1.6, 3.6])
    """
    some = np.abs(z[:: _thinned(len(z))].T, order="C")
    parts = np.array_split(some, 3, axis=1)
    told = [np.quantile(part, TAIL_QUANTILES, axis=1) for part in parts]
    inner, outer = np.stack(told, axis=1)
    share = (1 - TAIL_QUANTILES[0]) / (1 - TAIL_QUANTILES[1])
    length = (outer - inner) / np.log(share)
    far = inner + length * np.log((1 - TAIL_QUANTILES[0]) * len(z) / TAIL_CHANCE)
    shortest: Array = far.min(axis=0) / (LOUD_SAMPLE_SIGMAS * spread)
    return shortest


def _close_gaps(stretches: NDArray[np.intp], gap: int) -> NDArray[np.intp]:
    """Stretches with the short breaks between them closed."""
    out: list[list[int]] = []
    for first, last in stretches:
        if out and first - out[-1][1] <= gap:
            out[-1][1] = int(last)
        else:
            out.append([int(first), int(last)])
    return np.array(out, dtype=np.intp).reshape(-1, 2)


def _trim(size: Array, first: int, last: int) -> tuple[int, int]:
    """A stretch from its first large sample to its last; `size` (n,) in deviations.

    All of it where none stands out by itself: a gentle push.
    """
    large = np.flatnonzero(size[first:last] > STRETCH_SAMPLE_SIGMAS)
    if len(large) < 2 or size[first:last].max() <= LOUD_SAMPLE_SIGMAS:
        return first, last
    return first + int(large[0]), first + int(large[-1]) + 1
