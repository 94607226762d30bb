"""Faults of the line: bytes that are not the ones that were sent."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.errors import InputError
from fieldcal.sim_device.noise import stream

KINDS = ("garbage_bytes", "flip_bits", "lose_bytes", "double_bytes")
MOST = 100_000
"""Bytes or bits that one order can spoil."""


class LineFaults:
    """Spoils the next bytes that are sent, once for each order; seeded."""

    def __init__(self, seed: int) -> None:
        self._rng = stream(seed, "line faults")
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
