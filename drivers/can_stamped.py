"""Samples out of the frames of a log, whose stamps are the bus's own.

A live bus is timed by arrivals, which takes a second to begin with. In a log the stamps
are those of the adapter: they are the time, where the device sends none, from the first
sample on.
"""

from __future__ import annotations

from collections.abc import Sequence

from fieldcal.core.samples import Array, Block
from fieldcal.drivers.can_groups import CanHealth
from fieldcal.drivers.can_map import Part
from fieldcal.drivers.can_samples import STAMP, CanAssembler
from fieldcal.drivers.options import Options
from fieldcal.drivers.stamps import Stamps


class BusTimeAssembler(CanAssembler):
    """Puts samples together as `CanAssembler` does, timed by the bus."""

    def __init__(
        self, parts: Sequence[Part], health: CanHealth, options: Options
    ) -> None:
        super().__init__(parts, health, options)
        self._by_bus = not self._channel("t") and not options.text("rate")
        if self._by_bus:
            self._clock = Stamps(health)

    def _timed(self, values: Array, arrived: Array) -> Block | None:
        if self._by_bus:
            values[:, STAMP] = arrived
        return super()._timed(values, arrived)
