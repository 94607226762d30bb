"""Assembles samples from a CAN log, timed by the adapter's stamps.

On a live bus arrivals give the time, after the first second only. In a log the stamps
of the adapter give it from the first sample on, if the device sends no time.
"""

from __future__ import annotations

from collections.abc import Sequence

from fieldcal.core.samples import Array, Block
from fieldcal.drivers.can_frame_groups import CanLinkHealth
from fieldcal.drivers.can_map import FramePart
from fieldcal.drivers.can_samples import STAMP, CanAssembler
from fieldcal.drivers.options import Options
from fieldcal.drivers.stamp_timebase import StampTimebase


class BusTimeAssembler(CanAssembler):
    """Assembles samples as `CanAssembler`, timed by the bus."""

    def __init__(
        self, parts: Sequence[FramePart], health: CanLinkHealth, options: Options
    ) -> None:
        super().__init__(parts, health, options)
        self._by_bus = not self._channel("t") and not options.text("rate")
        if self._by_bus:
            self._clock = StampTimebase(health)

    def _timed(self, values: Array, arrived: Array) -> Block | None:
        if self._by_bus:
            values[:, STAMP] = arrived
        return super()._timed(values, arrived)
