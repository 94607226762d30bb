"""Extracts numbers from many CAN frames at once, as a DBC file defines them.

A field of L bits is cut out of a word w of eight bytes that hold it, taken in the byte
order of the field, s bits above the lowest:

    r = floor(w / 2^s) mod 2^L                                              (1)
    r <- r - 2^L where r >= 2^(L-1), if the field is signed                 (2)
    v = a r + b, with the scale a and the offset b of the DBC               (3)

The start bit is the lowest bit of a little-endian field, counted from the first byte's
lowest; of a big-endian one it is the highest, and 8 (i // 8) + 7 - i % 8 counts from
the first byte's highest. A field across nine bytes takes its last bits from the ninth.

Source: Vector, DBC file format documentation 1.0.5, section 8 (signal definitions).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.drivers.framing import as_doubles

if TYPE_CHECKING:
    from cantools.database.can import Signal

Words = NDArray[np.unsignedinteger[Any]]
Bytes = NDArray[np.uint8]

WORD_BYTES = 8

LONGEST = 64
"""Bytes of the longest frame, and bits of the longest number."""

_FLOATS = {16: np.float16, 32: np.float32, 64: np.float64}


@dataclass(frozen=True, slots=True)
class SignalField:
    """Position of a number in a frame, and its encoding.

    Attributes
    ----------
    first : byte at which the word begins
    ninth : byte that goes on above the word, -1 if there is none
    shift : s, bits of the word below the field
    length : L, bits
    big_endian, signed, floating : how the bits are read
    scale, offset : a and b
    special : raw numbers with a name in the DBC; these are no measurements
    size : bytes that a frame needs to hold it
    states : raw numbers that a counter has, where the DBC states them

    """

    first: int
    ninth: int
    shift: int
    length: int
    big_endian: bool
    signed: bool
    floating: bool
    scale: float
    offset: float
    special: tuple[int, ...]
    size: int
    states: int | None = None

    @classmethod
    def of(cls, signal: Signal) -> SignalField:
        """Field of a signal in a DBC database.

        Raises
        ------
        InputError
            If no frame can hold it, or its scale is no number.

        """
        _check_signal(signal)
        big, length = signal.byte_order == "big_endian", signal.length
        begin = _first_bit(signal)
        head, end = begin // 8, (begin + length + 7) // 8
        shift = 8 * end - begin - length if big else begin % 8
        first, ninth = head, -1
        if end - head > WORD_BYTES:
            first, ninth = (head + 1, head) if big else (head, head + WORD_BYTES)
        elif big:
            first = max(0, end - WORD_BYTES)
            shift += 8 * (first + WORD_BYTES - end)
        else:
            first = max(0, end - WORD_BYTES)
            shift += 8 * (head - first)
        return cls(
            first,
            ninth,
            shift,
            length,
            big,
            signal.is_signed,
            signal.is_float,
            float(signal.scale),
            float(signal.offset),
            tuple(int(value) for value in signal.choices or ()),
            end,
            _states(signal),
        )

    def bits(self, data: Bytes) -> Words:
        """Bits of the field in frames (m, bytes); (m,), unsigned, (1)."""
        window = np.ascontiguousarray(data[:, self.first : self.first + WORD_BYTES])
        order = ">u8" if self.big_endian else "<u8"
        word: Words = window.view(order)[:, 0] >> np.uint64(self.shift)
        if self.ninth >= 0:
            above = data[:, self.ninth].astype(np.uint64)
            word = word | above << np.uint64(8 * WORD_BYTES - self.shift)
        return word & np.uint64(2**self.length - 1)

    def raw(self, data: Bytes) -> NDArray[Any]:
        """Numbers of frames (m, bytes) before they are scaled, (m,)."""
        bits = self.bits(data)
        if self.floating:
            narrow = bits.astype(f"u{self.length // 8}")
            return as_doubles(narrow.view(_FLOATS[self.length]))
        if not self.signed:
            return bits
        sign = np.uint64(1 << (self.length - 1))
        return ((bits ^ sign) - sign).view(np.int64)  # (2)

    def values(self, data: Bytes) -> Array:
        """Physical numbers of frames (m, bytes), nan for a special one; (m,), (3)."""
        # a float of a damaged frame may have any value
        with np.errstate(over="ignore", invalid="ignore"):
            raw = self.raw(data)
            values: Array = raw * self.scale + self.offset  # (3)
        if self.special:
            values[np.isin(raw, self.special)] = np.nan
        return values

    @property
    def span(self) -> float:
        """Raw value at which a counter in this field wraps."""
        return float("inf") if self.floating else float(2**self.length)


def _states(signal: Signal) -> int | None:
    """How many numbers a signal has by its stated range; None if none is stated.

    A counter of the E2E profile 1 has four bits and counts from 0 to 14.
    """
    least, most = signal.minimum or 0, signal.maximum or 0
    plain = (signal.scale, signal.offset) == (1, 0) and not signal.is_signed
    if not (plain and 0 <= least < most < 2**signal.length):
        return None  # also where they are no numbers
    if least != int(least) or most != int(most):
        return None
    return int(most - least) + 1


def _first_bit(signal: Signal) -> int:
    """Number of bits before the signal, in its byte order."""
    if signal.byte_order == "big_endian":
        return 8 * (signal.start // 8) + 7 - signal.start % 8
    return signal.start


def _check_signal(signal: Signal) -> None:
    """Refuse a signal that no frame can contain."""
    end = _first_bit(signal) + signal.length
    fits = 0 < signal.length <= LONGEST and end <= 8 * LONGEST
    if signal.is_float:
        fits = fits and signal.length in _FLOATS
    try:
        finite = all(np.isfinite(float(v)) for v in (signal.scale, signal.offset))
    except OverflowError:
        finite = False
    if not (fits and finite):
        raise InputError(
            f"signal {signal.name} of the DBC file has {signal.length} bits from bit"
            f" {signal.start} on and the scale {str(signal.scale)[:20]}: no frame holds"
            " such a number; mend it, or name another signal by map"
        )
