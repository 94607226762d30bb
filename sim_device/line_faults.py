"""Faults of the line: bytes that are not the ones that were sent."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.sim_device.can_packing import CanPacket
from fieldcal.sim_device.random_process import random_stream

KINDS = ("garbage_bytes", "flip_bits", "lose_bytes", "double_bytes")
MOST = 100_000
"""Bytes or bits that one order can spoil."""


OTHERS = (0x300, 0x700)
"""Identifiers of somebody else's frames on a bus."""


class LineFaults:
    """Corrupts the next bytes that are sent, once for each order; seeded."""

    def __init__(self, seed: int) -> None:
        self._rng = random_stream(seed, "line faults")
        self._orders: list[tuple[str, int]] = []

    def order(self, faults: Mapping[str, int]) -> None:
        """Spoil the next bytes by so many of each kind.

        Raises
        ------
        InputError
            If a number is none, or there is no such kind.

        """
        for kind, count in faults.items():
            if kind not in KINDS:
                raise InputError(f"no fault {kind!r} of the line; there are {KINDS}")
            whole = isinstance(count, int) and not isinstance(count, bool)
            if not whole or not 0 < count <= MOST:
                raise InputError(f"{kind} must be a whole number from 1 to {MOST}")
        self._orders += faults.items()

    def spoil(self, data: bytes) -> bytes:
        """Carry out what was ordered, once there are bytes to spoil."""
        if not data or not self._orders:
            return data
        out = np.frombuffer(data, np.uint8).copy()
        for kind, count in self._orders:
            out = self._spoil(out, kind, count)
        self._orders.clear()
        return out.tobytes()

    def spoil_frames(self, frames: Sequence[CanPacket]) -> list[CanPacket]:
        """Carry out what was ordered on frames of a bus, each in place of a byte.

        A bus checks its frames: one with a flipped bit is lost. Garbage is frames that
        belong to somebody else.
        """
        out = list(frames)
        if not out or not self._orders:
            return out
        for kind, count in self._orders:
            at_each = self._rng.integers(0, max(1, len(out)), count)
            chosen = set(at_each.tolist())
            if kind == "garbage_bytes":
                others = self._rng.integers(*OTHERS, count).tolist()
                out[:0] = [CanPacket(other, self._rng.bytes(8)) for other in others]
            elif kind == "double_bytes":
                out = [f for i, f in enumerate(out) for _ in range(1 + (i in chosen))]
            else:
                out = [f for i, f in enumerate(out) if i not in chosen]
        self._orders.clear()
        return out

    def _spoil(
        self, out: np.ndarray[tuple[int], np.dtype[np.uint8]], kind: str, count: int
    ) -> np.ndarray[tuple[int], np.dtype[np.uint8]]:
        if kind == "garbage_bytes":
            at = int(self._rng.integers(0, len(out) + 1))
            junk = self._rng.integers(0, 256, count, dtype=np.uint8)
            return np.concatenate([out[:at], junk, out[at:]])
        if not len(out):
            return out
        at_each = np.sort(self._rng.integers(0, len(out), count))
        if kind == "flip_bits":
            masks = np.left_shift(1, self._rng.integers(0, 8, count)).astype(np.uint8)
            np.bitwise_xor.at(out, at_each, masks)
            return out
        if kind == "lose_bytes":
            return np.delete(out, at_each)
        return np.insert(out, at_each, out[at_each])
