"""Rates at rest as they were before a device subtracted a mean at each stop.

A device that has stopped waits for a time D, takes the mean m of its outputs over a
time T, and adds it to what it subtracts from then on, until it has stopped again. As
these outputs are recorded, so is what was subtracted: after the stops 1 to k

    rates before = outputs + m_1 + ... + m_k + a constant                          (1)

If the device does that, the rates before are those of gyroscopes that keep their bias,
and the outputs are not: they change by -m within each stop. The change of variables (1)
has the determinant 1, so that the density of the outputs is that of the rates before.
Device axes, rad/s.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from fieldcal.acceptance.rest_steps import RestStep, Stop, sample_period
from fieldcal.core.samples import Array, Block, Index

DELAYS = (0.0, 0.25, 0.5, 1.0)
"""Times from the end of a turn until a device takes its mean, s."""

LENGTHS = np.geomspace(0.5, 8.0, 9)
"""Times over which it takes a mean, s."""

PARTS = 4
"""Into how many parts a window is cut after that."""

RECORDED = 0.5
"""Least part of the samples of a mean that have to be recorded."""

WAYS = np.array([(delay, delay + time) for delay in DELAYS for time in LENGTHS])
"""(v, 2) when a mean begins and ends, s after a turn."""


def steps_before_means(
    stops: Sequence[Stop], block: Block, axes: Index
) -> tuple[list[RestStep], list[RestStep]]:
    """Steps of rest for each of `WAYS`, (v, a) rad/s: outputs, and the rates before.

    A stop of which the mean is not recorded counts as one without a mean.
    """
    sums = _Sums(block, axes)
    outputs, before = list[RestStep](), list[RestStep]()
    subtracted = np.zeros((len(WAYS), len(axes)))
    for stop in stops:
        start = float(stop.window.t[0]) - stop.settled
        mean, after = sums.means_of_spans(start + WAYS), start + WAYS[:, 1]
        ends = float(stop.window.t[-1]) + stop.stays
        takes = stop.turned & (after <= ends)[:, None] & np.isfinite(mean)
        mean = np.where(takes, mean, 0.0)
        cut = np.where(takes.any(axis=1), stop.window.t.searchsorted(after), np.inf)
        steps = list(_parts(stop, sums, cut))
        added = [subtracted] + [subtracted + mean] * PARTS  # (1)
        raw = [
            RestStep(s.seconds, s.since_turn, s.rates + more)
            for s, more in zip(steps, added, strict=True)
        ]
        outputs += stop.enclosed(steps)
        before += stop.enclosed(raw)
        subtracted = subtracted + mean
    return outputs, before


class _Sums:
    """Sums of the rates up to each sample of a block."""

    def __init__(self, block: Block, axes: Index) -> None:
        self._t, self._period = block.t, sample_period(block)
        known = np.isfinite(block.gyr[:, axes])
        rates = np.where(known, block.gyr[:, axes], 0.0)
        self._sums = np.zeros((len(block) + 1, len(axes)))
        np.cumsum(rates, axis=0, out=self._sums[1:])
        self._counts = np.zeros(self._sums.shape, dtype=np.int32)
        np.cumsum(known, axis=0, dtype=np.int32, out=self._counts[1:])

    def sample_at(self, time: float) -> int:
        """Number of the first sample from an instant on, s."""
        return int(self._t.searchsorted(time))

    def means_of_spans(self, spans: Array) -> Array:
        """Means over (v, 2) spans of time, (v, a) rad/s; nan where few are recorded."""
        least = RECORDED * np.diff(spans) / self._period
        first, last = self._t.searchsorted(spans).T
        return self.means(first, last, least)

    def means(self, first: Index, last: Index, least: Array | float = 0.0) -> Array:
        """Means over samples (v,) each, (v, a) rad/s; nan if not more than `least`."""
        count = self._counts[last] - self._counts[first]
        total = self._sums[last] - self._sums[first]
        found: Array = np.where(count > least, total / np.maximum(count, 1), np.nan)
        return found


def _parts(stop: Stop, sums: _Sums, cut: Array) -> Iterator[RestStep]:
    """Steps of a window that is cut at (v,) samples, and the rest of it into parts."""
    window, period = stop.window, sample_period(stop.window)
    first = np.minimum(cut, len(window)).astype(int)[:, None]
    rest = (len(window) - first) * np.arange(PARTS + 1) // PARTS
    edges = np.hstack([0 * first, first + rest])
    start = sums.sample_at(float(window.t[0]))
    for begin, end in zip(edges.T[:-1], edges.T[1:], strict=True):
        rates = sums.means(start + begin, start + end)
        rates[:, np.isnan(stop.noise)] = np.nan
        since = stop.settled + begin[:, None] * period
        yield RestStep((end - begin)[:, None] * period, since, rates)
