"""Whether the device has come to rest, before a window begins.

Every 0.1 s the means y of the last 0.8 s of cells are looked at:

    a = sqrt(mean of (y_i - y_i-1)^2 / 2)          noise of a cell                 (1)
    d = sd of y about their straight line          oscillation                     (2)
    e = their slope times 0.8 s                    trend                           (3)
    w = mean rate less that of the last rest       constant rotation               (4)

The device is at rest if d, e and w of every channel are explained by noise. The noise
is the lower decile of a in the last 20 s. It is thus known from the first second on,
and a turn does not change it. A device that becomes noisier counts as at rest again
when the 20 s have passed.

On a base that sways, this test never finds rest. If the session states that the base
sways, the device is at rest if the scatter of y is within the limits of `limits`.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.windows.cells import CELL, CellAccumulator, resolution
from fieldcal.windows.limits import StillnessLimits
from fieldcal.windows.rounding import visible_steps

CELLS_TOGETHER = 8
"""Cells that are evaluated together: 0.8 s."""

MEMORY = 200
"""Cells the noise is remembered for: 20 s."""

SPREAD_RATIO, SLOPE_RATIO = 3.5, 6.0
"""Multiples of the noise within which (2) and (3) are rest."""

RATE = 0.006
"""Change of a gyroscope's bias from one rest to the next, rad/s: more is a turn."""

BIAS_CELLS = 30
"""Cells after which a constant rate is a bias and not a turn by hand: 3 s."""

_SMALLEST = 1.6
"""Ratio of the noise to the lower decile of its estimates (1) in 20 s."""

_UNKNOWN = 0.2
"""Part of the limits that applies until the device has been at rest once."""

_TIME = np.arange(CELLS_TOGETHER) - (CELLS_TOGETHER - 1) / 2
_SLOPE = CELLS_TOGETHER * _TIME / (_TIME @ _TIME)
"""Times of the cells about their middle, in cells; and the weights of the cells whose
sum is slope times duration, (3)."""


class Stillness:
    """Watches a stream of samples and detects whether the device is at rest.

    The result does not depend on how the samples were cut into blocks.

    Parameters
    ----------
    sways : whether the session states that the base sways

    Attributes
    ----------
    meter : present motion over the allowed motion; below 1 is rest
    since : device time from which on it has been at rest, s; None while it moves

    """

    def __init__(self, sways: bool = False) -> None:
        self._limits, self._sways = StillnessLimits(), sways
        self._cells = CellAccumulator()
        self._recent: deque[tuple[Array, Array]] = deque(maxlen=CELLS_TOGETHER)
        self._finest = np.full(6, np.inf)
        self._noises: deque[Array] = deque(maxlen=MEMORY)
        self._rest: Array | None = None
        self._even = 0
        self.meter = np.inf
        self.since: float | None = None

    @property
    def still(self) -> bool:
        """Whether the device is at rest now."""
        return self.since is not None

    def add(self, block: Block) -> None:
        """Take in the block that follows; costs as much as the block is long."""
        self._cells.add(block)
        complete = self._cells.take_complete()
        for time, mean, short, finest in zip(
            complete.times,
            complete.means,
            complete.short_lag_variance,
            complete.smallest_changes,
            strict=True,
        ):
            self._recent.append((np.nan_to_num(mean), np.nan_to_num(short)))
            self._finest = np.minimum(self._finest, finest)
            if len(self._recent) == CELLS_TOGETHER:
                self._judge(float(time))

    def _judge(self, time: float) -> None:
        """Evaluate the last cells; `time` is the start of the last one, s."""
        y, short = (np.array(rows) for rows in zip(*self._recent, strict=True))
        self._noises.append(np.sqrt((np.diff(y, axis=0) ** 2).mean(axis=0) / 2))  # (1)
        noise = self._noise(np.sqrt(short.mean(axis=0)))
        if self._sways:
            self.meter = self._swinging(y)
        else:
            self.meter = max(
                self._motion_ratio(y, noise), self._turning(y[:, 3:], noise[3:])
            )
        if self.meter > 1:
            self.since = None
        elif self.since is None:
            self.since = time - (CELLS_TOGETHER - 1) * CELL
        if self.since is not None and time - self.since > 2 * CELLS_TOGETHER * CELL:
            self._rest = y[:, 3:].mean(axis=0)

    def _noise(self, sampled: Array) -> Array:
        """Noise of a cell mean, (6,); `sampled` is the short-lag noise, (6,)."""
        smallest = _SMALLEST * np.quantile(self._noises, 0.1, axis=0)
        noise: Array = np.maximum(
            smallest, visible_steps(resolution(self._finest), sampled)
        )
        return noise

    def _motion_ratio(self, y: Array, noise: Array) -> float:
        """Ratio of (2) and (3) to the bounds by noise, within the absolute limits."""
        slope = _SLOPE @ y
        about = y - y.mean(axis=0) - np.outer(_TIME, slope) / CELLS_TOGETHER
        spread = np.sqrt((about**2).sum(axis=0) / (CELLS_TOGETHER - 2))
        known = 1.0 if self._rest is not None else _UNKNOWN
        bound = known * self._limits.noise
        ratio = np.maximum(
            spread / _zero_as_inf(np.minimum(SPREAD_RATIO * noise, bound)),
            np.abs(slope) / _zero_as_inf(np.minimum(SLOPE_RATIO * noise, bound)),
        )
        return float(ratio.max())

    def _swinging(self, y: Array) -> float:
        """Ratio of the scatter to the limits, for a base that sways."""
        return float(np.max(y.std(axis=0) / self._limits.noise))

    def _turning(self, rates: Array, noise: Array) -> float:
        """Ratio of (4) to the allowed change of a bias; a lasting even rate is one."""
        if self._rest is None:
            return 0.0
        off = np.abs(rates.mean(axis=0) - self._rest) / (RATE + SPREAD_RATIO * noise)
        even = np.abs(np.diff(rates, axis=0)).max(axis=0) <= 3 * SLOPE_RATIO * noise
        self._even = self._even + 1 if off.max() > 1 and even.all() else 0
        return float(off.max()) if self._even < BIAS_CELLS else 0.0


def _zero_as_inf(allowed: Array) -> Array:
    """Allowed motion, infinite for a channel without noise, which is not judged."""
    return np.where(allowed > 0, allowed, np.inf)
