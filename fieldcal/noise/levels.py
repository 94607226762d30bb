"""A recording reduced in one pass: powers of cosine coefficients, level by level.

Level 0 are the samples; each further level consists of means over eight values of the
level below. Each frequency is evaluated in one level only: of stretches of 1024 means
the coefficients k = 64 ... 511 (of samples up to 1023), three octaves up to half of the
highest frequency of the means. The first level that has 16384 means or fewer is kept
whole; its coefficients go down to one half wave in the recording. Memory grows with the
logarithm of the length.

The powers are summed in bins of an eighth of an octave, and in ten folds, so that some
can be held out: stretches in turn, or coefficients of the whole in turn.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fieldcal.core.samples import Array, Index

SEGMENT = 1024
FACTOR = 8
KEPT = 16 * SEGMENT
LOWEST, HIGHEST = SEGMENT // 16, SEGMENT // 2
"""Range of coefficients that a level between the samples and the last one uses."""

FOLDS = 10
PER_OCTAVE = 8
"""Bins."""

LAGS = (1, 2, 4)
"""Lengths of means whose differences are summed in each level below the last."""


class LevelSums(NamedTuple):
    """Summed powers of the stretches of a level that is not the last.

    Attributes
    ----------
    m : samples in a mean
    edges : (b + 1,) first coefficient of each bin, and the end
    power : (b, folds, c) sums of squared coefficients
    number : (b, folds) how many they are

    """

    m: int
    edges: Index
    power: Array
    number: Array


@dataclass(frozen=True, slots=True)
class ReducedStretch:
    """Result of the reduction of one stretch of evenly spaced samples.

    Attributes
    ----------
    dt : s between samples
    samples : how many there were
    levels : those below the last
    m : samples in a mean of the last level
    means : (n, c) of the last level, less `origin`
    origin : (c,)
    squares, number : sums of squared differences of neighbouring means, (j, c), and how
        many, (j,), of the levels below the last at `lags`
    lags : (j,) length of those means, samples

    """

    dt: float
    samples: int
    levels: tuple[LevelSums, ...]
    m: int
    means: Array
    origin: Array
    squares: Array
    number: Array
    lags: Index


def octave_bins(first: int, end: int) -> Index:
    """First coefficients of bins of an eighth of an octave, and the end.

    >>> octave_bins(1, 6)
    array([1, 2, 3, 4, 5, 6])
    """
    octaves = np.log2(end / first)
    edges = first * 2 ** (np.arange(int(octaves * PER_OCTAVE) + 1) / PER_OCTAVE)
    return np.unique(np.append(np.round(edges[edges < end]), end)).astype(np.intp)


class CosineLevels:
    """Reduces samples as they come; `reduced` returns the result.

    Parameters
    ----------
    dt : s between samples
    channels : columns; of the first `noisy` powers are taken, of all means
    noisy : see there

    """

    def __init__(self, dt: float, channels: int, noisy: int) -> None:
        self._dt, self._channels, self._noisy = dt, channels, noisy
        self._origin: Array | None = None
        self._levels = [_Level(0, channels, noisy)]

    def add(self, values: Array) -> None:
        """Take samples, (n, c), none of them missing."""
        if self._origin is None and len(values):
            self._origin = values[0].copy()
        rows: Array = values if self._origin is None else values - self._origin
        number = 0
        while len(rows):
            if number == len(self._levels):
                self._levels.append(_Level(number, self._channels, self._noisy))
            rows = self._levels[number].add(rows)
            number += 1

    def reduced(self) -> ReducedStretch:
        """Sums of all levels below the first that is kept whole."""
        last = next(i for i, level in enumerate(self._levels) if level.whole)
        below = self._levels[:last]
        return ReducedStretch(
            self._dt,
            self._levels[0].count,
            tuple(level.sums() for level in below),
            FACTOR**last,
            np.concatenate([np.empty((0, self._channels)), *self._levels[last].kept]),
            np.zeros(self._channels) if self._origin is None else self._origin,
            np.array([row for lv in below[1:] for row in lv.squares]).reshape(
                -1, self._noisy
            ),
            np.array([n for lv in below[1:] for n in lv.number], dtype=float),
            np.array([FACTOR**lv.level * lag for lv in below[1:] for lag in LAGS],
                     dtype=np.intp),
        )  # fmt: skip


class _Level:
    """Means of one length."""

    def __init__(self, level: int, channels: int, noisy: int) -> None:
        self.level, self.count, self._noisy = level, 0, noisy
        self.kept: list[Array] = []
        self.squares = np.zeros((len(LAGS), noisy))
        self.number = np.zeros(len(LAGS))
        self._edges = octave_bins(LOWEST, HIGHEST if level else SEGMENT)
        self._power = np.zeros((len(self._edges) - 1, FOLDS, noisy))
        self._segments = np.zeros(FOLDS)
        self._done = 0
        self._open: Array = np.empty((0, channels))
        self._over: Array = np.empty((0, channels))
        self._tail: Array = np.empty((0, noisy))

    @property
    def whole(self) -> bool:
        """Whether all of its means are kept."""
        return self.count <= KEPT

    def add(self, rows: Array) -> Array:
        """Take means; returns those of the next level."""
        self.count += len(rows)
        if self.whole:
            self.kept.append(rows)
        else:
            self.kept = []
        self._differences(rows)
        self._coefficients(np.concatenate([self._open, rows]))
        above = np.concatenate([self._over, rows])
        full = len(above) // FACTOR * FACTOR
        self._over = above[full:].copy()
        cells = above[:full].reshape(-1, FACTOR, above.shape[1])
        means: Array = np.einsum("nfc->nc", cells) / FACTOR
        return means

    def sums(self) -> LevelSums:
        """Summed powers of the stretches at this level."""
        count = np.outer(np.diff(self._edges), self._segments)
        return LevelSums(FACTOR**self.level, self._edges, self._power, count)

    def _coefficients(self, rows: Array) -> None:
        from scipy.fft import dct

        segments = len(rows) // SEGMENT
        used = rows[: segments * SEGMENT, : self._noisy]
        self._open = rows[segments * SEGMENT :].copy()
        if not segments:
            return
        stretches = used.reshape(segments, SEGMENT, -1).transpose(2, 0, 1)
        found = dct(np.ascontiguousarray(stretches), norm="ortho", overwrite_x=True)
        end = self._edges[-1]
        np.square(found, out=found)
        power = np.add.reduceat(found[:, :, :end], self._edges[:-1], axis=2)
        folds = (self._done + np.arange(segments)) % FOLDS
        for fold in range(FOLDS):
            self._power[:, fold] += power[:, folds == fold].sum(axis=1).T
        self._segments += np.bincount(folds, minlength=FOLDS)
        self._done += segments

    def _differences(self, rows: Array) -> None:
        if not self.level:  # as many as there are samples, and never asked for
            return
        some = np.concatenate([self._tail, rows[:, : self._noisy]])
        # each lag goes on where it ended: the last 2 lag - 1 means are still to begin
        new = len(rows)
        for i, lag in enumerate(LAGS):
            first = max(0, len(some) - new - 2 * lag + 1)
            steps = neighbour_differences(some[first:], lag)
            self.squares[i] += np.einsum("nc,nc->c", steps, steps)
            self.number[i] += len(steps)
        self._tail = some[-(2 * LAGS[-1] - 1) :].copy()


def neighbour_differences(rows: Array, lag: int) -> Array:
    """Differences of neighbouring means over `lag` rows, overlapping, (n', c)."""
    if len(rows) < 2 * lag:
        return np.empty((0, rows.shape[1]))
    if lag == 1:
        return np.diff(rows, axis=0)
    total = np.concatenate([np.zeros((1, rows.shape[1])), np.cumsum(rows, axis=0)])
    bend: Array = (total[2 * lag :] - 2 * total[lag:-lag] + total[: -2 * lag]) / lag
    return bend
