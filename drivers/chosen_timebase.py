"""Chooses the timebase of a stream: device stamps, a declared rate, or arrivals."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.drivers.arrival_timebase import ArrivalTimebase
from fieldcal.drivers.driver import LinkHealth
from fieldcal.drivers.options import Options
from fieldcal.drivers.stamp_timebase import StampTimebase
from fieldcal.drivers.timebase import RateTimebase, Timebase


class ChosenTimebase:
    """Uses stamps if the first sample has one, else option ``rate``, else arrivals.

    Parameters
    ----------
    health : where gaps, missing and repeated samples and restarts are counted
    options : ``rate`` in Hz is taken from them
    resolution : of the device's stamps, s
    span : time after which the device's counter wraps, s
    since_power_on : whether the stamps count from when the device was switched on

    """

    def __init__(
        self,
        health: LinkHealth,
        options: Options,
        resolution: float = 0.0,
        span: float = float("inf"),
        *,
        since_power_on: bool = False,
    ) -> None:
        rate = options.number("rate", 0.0, 1e-3, 1e6)
        self._health = health
        self._stamps = StampTimebase(
            health, resolution, span, since_power_on=since_power_on
        )
        self._else = RateTimebase(health, rate) if rate else ArrivalTimebase(health)
        self._chosen: Timebase | None = None

    def times(self, stamps: Array, steps: Array, t_host: Array) -> Array:
        """Return times (n,) in s, nan for a sample to drop."""
        if not len(stamps):
            return stamps
        if self._chosen is None:
            self._chosen = self._else if np.isnan(stamps[0]) else self._stamps
            self._health.clocked = not isinstance(self._chosen, ArrivalTimebase)
        return self._chosen.times(stamps, steps, t_host)

    def coarsen(self, resolution: float) -> None:
        """Take the device's stamps for cut to a resolution, s, from now on."""
        self._stamps.coarsen(resolution)

    def link_broken(self) -> None:
        """Note that the link was interrupted before the next sample."""
        if self._chosen is not None:
            self._chosen.link_broken()
