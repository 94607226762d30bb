"""Frames of one bus, out of a log that may be of several.

The same identifiers on two buses are two IMUs: their frames must not become the samples
of one. Which bus is meant is said by ``channel``; where only one of them carries such
frames, that is the one.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.drivers.can_frames import Frames, Packed

MOST = 0xFFFF
"""Buses that are told apart."""


class _Numbers(dict[Any, int]):
    """Number of each bus, in the order in which they turn up."""

    def __missing__(self, channel: Any) -> int:
        self[channel] = number = min(len(self), MOST)
        return number


class Buses:
    """Packs the messages of a log, and keeps those of one bus.

    Parameters
    ----------
    place : of the log, for errors
    identifiers : of the frames that make samples
    channel : the bus that is meant, "" if there is only one

    """

    def __init__(self, place: str, identifiers: Iterable[int], channel: str) -> None:
        self._place, self._channel = place, channel
        self._identifiers = sorted(identifiers)
        self._numbers = _Numbers()
        self._with_samples: set[int] = set()

    def fill(self, packed: Packed, messages: Iterable[Any]) -> None:
        """Pack messages, up to one that cannot be read."""
        packed.fill(messages, self._numbers)

    def frames(self, packed: Packed) -> Frames:
        """Frames of the bus that is meant.

        Raises
        ------
        InputError
            If frames that make samples come from several, and none is chosen.

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
        """Buses with frames that make samples."""
        there = {str(c) for c, n in self._numbers.items() if n in self._with_samples}
        return sorted(there)

    def finish(self) -> None:
        """Check at the end of the log that the bus that was meant is in it.

        Raises
        ------
        InputError
            If it has not one frame that makes samples.

        """
        if self._channel and self._channel not in self._names:
            raise InputError(
                f"{self._place}: no frame of the map comes from {self._channel}, but"
                f" from {', '.join(self._names) or 'no bus'}: mend channel among the"
                " options"
            )
