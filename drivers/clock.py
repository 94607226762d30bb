"""Which time a stream gets: the device's stamps, a declared rate, or its arrivals."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.drivers.arrivals import Arrivals
from fieldcal.drivers.driver import Health
from fieldcal.drivers.options import Options
from fieldcal.drivers.stamps import Stamps
from fieldcal.drivers.timebase import Rate, Timebase


class Clock:
    """Takes stamps if the first sample has one, else option ``rate``, else arrivals.

    Parameters
    ----------
    health : where gaps, missing and repeated samples and restarts are counted
    options : ``rate`` in Hz is taken from them
    resolution : of the device's stamps, s
    span : of the device's counter, s, where it wraps

    """

    def __init__(
        self,
        health: Health,
        options: Options,
        resolution: float = 0.0,
        span: float = float("inf"),
    ) -> None:
        rate = options.number("rate", 0.0, 1e-3, 1e6)
        self._health = health
        self._stamps = Stamps(health, resolution, span)
        self._else = Rate(health, rate) if rate else Arrivals(health)
        self._chosen: Timebase | None = None

    def times(self, stamps: Array, steps: Array, t_host: Array) -> Array:
        """Return times (n,) in s, nan for a sample to drop."""
        if not len(stamps):
            return stamps
        if self._chosen is None:
            self._chosen = self._else if np.isnan(stamps[0]) else self._stamps
            self._health.clocked = not isinstance(self._chosen, Arrivals)
        return self._chosen.times(stamps, steps, t_host)

    def broken(self) -> None:
        """Take note that the link was away before the next sample."""
        if self._chosen is not None:
            self._chosen.broken()
