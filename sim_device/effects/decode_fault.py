"""Raw words of 16 bit are decoded wrongly, r = round(x 2^15 / full scale).

low_byte_signed   256 (r >> 8) + signed(r & 255): 256 too low in half of all cases
bytes_swapped     the low byte taken for the high one
wrapped           r beyond 2^15 comes out at the other end instead of clipped
wild              one word in 500, drawn by its time, has its bits mixed up
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array
from fieldcal.sim_device.earth import STANDARD_GRAVITY
from fieldcal.sim_device.effect import (
    CHANNEL,
    NOT_NEGATIVE,
    Example,
    Number,
    SimulatedEffect,
    Stage,
    Word,
    rows,
)

KINDS = ("low_byte_signed", "bytes_swapped", "wrapped", "wild")
RARE = 500
"""Words of which one is wild."""

ACC_FULL_SCALE = 16 * STANDARD_GRAVITY
GYR_FULL_SCALE = float(np.deg2rad(2000))
"""What a device without a full scale of its own has."""

WRAPPED_ACC, WRAPPED_GYR = 8.0, 0.2
"""Full scale that wraps, if none is given: passed at home, and in an ordinary turn."""


class SimulatedDecodeFault(SimulatedEffect):
    """Kind of the decoding fault, and the affected outputs."""

    NUMBERS = {"full_scale": Number(0.0, NOT_NEGATIVE)}
    WORDS = {"channel": CHANNEL, "kind": Word("|".join(KINDS))}
    REPEATS = True
    ORDER = 3
    EXAMPLE = Example({"channel": "ax", "kind": "low_byte_signed"})

    def stage(self, full_scale: Array) -> Stage:
        """Encoded as the device does, and decoded wrongly."""
        kind = self.words["kind"]

        def misread(t: Array, x: Array) -> None:
            for row in rows(self.words["channel"]):
                full = self["full_scale"] or _usual(full_scale[row], row, kind)
                raw = np.rint(x[row] * (32768 / full)).astype(np.int64)
                if kind != "wrapped":
                    raw = np.clip(raw, -32768, 32767)
                read = _wild(raw, t) if kind == "wild" else _misread(raw, kind)
                x[row] = read * (full / 32768)

        return misread


def _usual(full_scale: float, row: int, kind: str) -> float:
    """Full scale that the words are taken to have if none is given."""
    if kind == "wrapped":
        return WRAPPED_ACC if row < 3 else WRAPPED_GYR
    if np.isfinite(full_scale):
        return float(full_scale)
    return ACC_FULL_SCALE if row < 3 else GYR_FULL_SCALE


def _misread(raw: NDArray[np.int64], kind: str) -> Array:
    """16-bit words as a faulty decoder reads them, (n,)."""
    low, high = raw & 0xFF, (raw >> 8) & 0xFF
    if kind == "low_byte_signed":
        word = (high << 8) + np.where(low < 128, low, low - 256)
    elif kind == "bytes_swapped":
        word = (low << 8) + high
    else:
        word = raw
    return ((word + 32768) % 65536 - 32768).astype(float)


def _wild(raw: NDArray[np.int64], t: Array) -> Array:
    """16-bit words of which some have their bits mixed up, (n,)."""
    drawn = np.rint(1e4 * t).astype(np.int64) * 2_654_435_761 % 2**32
    bits = np.where(drawn % RARE == 0, drawn >> 16, 0)
    return (((raw ^ bits) + 32768) % 65536 - 32768).astype(float)
