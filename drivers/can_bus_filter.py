"""Selects the frames of one bus from a log that may contain several.

The same identifiers on two buses belong to two IMUs, and must not be mixed. Option
``channel`` names the bus. Without it, the bus that carries frames of the map is used,
if there is only one.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.drivers.can_frames import FrameBuffer, Frames

MOST_BUSES = 0xFFFF
"""Largest number of buses that are distinguished."""


class _BusNumbers(dict[Any, int]):
    """Number of each bus, in order of first appearance."""

    def __missing__(self, channel: Any) -> int:
        self[channel] = number = min(len(self), MOST_BUSES)
        return number


class BusFilter:
    """Converts the messages of a log to rows, and selects those of one bus.

    Parameters
    ----------
    place : address of the log, for error texts
    identifiers : those of the frames in the map
    channel : the bus to select, "" if there is only one

    """

    def __init__(self, place: str, identifiers: Iterable[int], channel: str) -> None:
        self._place, self._channel = place, channel
        self._identifiers = sorted(identifiers)
        self._numbers = _BusNumbers()
        self._with_samples: set[int] = set()

    def fill(self, packed: FrameBuffer, messages: Iterable[Any]) -> None:
        """Convert messages, up to one that cannot be read."""
        packed.fill(messages, self._numbers)

    def frames(self, packed: FrameBuffer) -> Frames:
        """Frames of the selected bus.

        Raises
        ------
        InputError
            If several buses carry frames of the map, and none is chosen.

        """
        frames = packed.frames
        bus = frames["bus"]
        if len(self._numbers) > 1 or not self._with_samples:
            known = np.isin(frames["id"], self._identifiers)
            self._with_samples |= set(np.unique(bus[known]).tolist())
        if self._channel:
            meant = [n for c, n in self._numbers.items() if str(c) == self._channel]
            return frames[np.isin(bus, meant)]
        if len(self._with_samples) > 1:
            raise InputError(
                f"{self._place}: frames of the map come from the buses"
                f" {', '.join(self._names)}: choose one, such as"
                f" channel={self._names[-1]} among the options"
            )
        return frames

    @property
    def _names(self) -> list[str]:
        """Buses that carry frames of the map."""
        there = {str(c) for c, n in self._numbers.items() if n in self._with_samples}
        return sorted(there)

    def finish(self) -> None:
        """Check at the end of the log that the selected bus occurred.

        Raises
        ------
        InputError
            If it has no frame of the map.

        """
        if self._channel and self._channel not in self._names:
            raise InputError(
                f"{self._place}: no frame of the map comes from {self._channel}, but"
                f" from {', '.join(self._names) or 'no bus'}: mend channel among the"
                " options"
            )
