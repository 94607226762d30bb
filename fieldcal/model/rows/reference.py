"""A reference of the device's motion, interpolated, and filtered as a sensor does.

A channel is a cubic spline through its samples. What a sensor with a low-pass makes of
it (`fieldcal.model.rows.low_pass`) is a spline as well. Units: s, m/s^2, rad/s; axes of
the reference.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from copy import copy
from typing import Self

import numpy as np
from scipy.interpolate import PPoly

from fieldcal.core.samples import Array, Block, Index, Mask
from fieldcal.model import detections
from fieldcal.model.rows.knots import even_times, hermite_spline, spline_through


class Reference:
    """A reference of the motion, interpolated by cubic splines.

    Parameters
    ----------
    block : its samples; missing channels are taken as 0

    Attributes
    ----------
    observed : (6,) channels that it has
    start, end : s of its clock
    splines : of the channels that it has, those with the same samples as one, with the
        channels' numbers

    """

    def __init__(self, block: Block) -> None:
        six = block.six
        self.observed = np.isfinite(six).sum(axis=0) >= detections.MIN_SAMPLES
        whole = np.isfinite(six[:, self.observed]).any(axis=1)
        self.t, self.step = block.t[whole], float(np.median(np.diff(block.t[whole])))
        self.start, self.end = float(self.t[0]), float(self.t[-1])
        self.splines: list[tuple[Index, PPoly]] = [
            (channels, spline_through(block.t[known], six[np.ix_(known, channels)]))
            for known, channels in self._by_missing_samples(np.isfinite(six))
        ]

    def _by_missing_samples(self, finite: Mask) -> Iterator[tuple[Mask, Index]]:
        """Samples (n,), and the channels that it has of which these are known."""
        alike: dict[bytes, list[int]] = {}
        for c in np.flatnonzero(self.observed).tolist():
            alike.setdefault(finite[:, c].tobytes(), []).append(c)
        for channels in alike.values():
            yield finite[:, channels[0]], np.array(channels)

    @property
    def missing_channels(self) -> Index:
        """Missing channels of triads that are not missing altogether."""
        observed = np.repeat(self.observed.reshape(2, 3).any(axis=1), 3)
        return np.flatnonzero(observed & ~self.observed)

    def at(self, s: Array, order: int = 0) -> Array:
        """The six channels, or a derivative, at instants of its clock, (n, 6)."""
        out = np.zeros((len(s), 6))
        for channels, spline in self.splines:
            out[:, channels] = spline(s, order)
        return out

    def filtered_by(self, sensor: Callable[[PPoly], PPoly]) -> Self:
        """The reference after a filter is applied to each spline."""
        return self.with_splines(
            [(channels, sensor(spline)) for channels, spline in self.splines]
        )

    def with_splines(self, splines: list[tuple[Index, PPoly]]) -> Self:
        """The same instants with other splines of the channels."""
        out = copy(self)
        out.splines = splines
        return out

    def select_channels(self, channels: Collection[int]) -> Self:
        """The reference of some of its channels alone; the others are 0."""
        out = copy(self)
        out.splines = []
        for of, spline in self.splines:
            kept = [c in channels for c in of.tolist()]
            if any(kept):
                some = PPoly.construct_fast(spline.c[..., kept], spline.x)
                out.splines.append((of[kept], some))
        return out

    def averaged_over(self, offsets: Array, step: float) -> Self:
        """The reference's mean over some samples, at their middle.

        Parameters
        ----------
        offsets : (m,) s, of each sample from the middle
        step : s between the knots of its splines

        """

        def mean(spline: PPoly) -> PPoly:
            t, m = even_times(spline.x, step), len(offsets)
            values, change = (sum(spline(t + o, k) for o in offsets) for k in (0, 1))
            return hermite_spline(t, values / m, change / m)

        return self.filtered_by(mean)

    def covers(self, s: Array, margin: float) -> Mask:
        """Which instants, s, are inside the reference by a margin and in no gap."""
        inside = (s > self.start + margin) & (s < self.end - margin)
        after = np.clip(np.searchsorted(self.t, s), 1, len(self.t) - 1)
        apart = self.t[after] - self.t[after - 1]
        return inside & (apart < detections.PAUSE_INTERVALS * self.step)
