"""Checksums of many stretches of bytes at once.

With b_i the bytes, the sums over a stretch from s to e are, modulo 256,

    A = sum of b_i                                                          (1)
    B = sum of (e - i) b_i = e A - sum of i b_i, the sum of the running sums (2)

A is the plain sum, (A, B) Fletcher's checksum. A cyclic redundancy check that begins
at 0 is linear over exclusive or: with R_k(b) the remainder of byte b and k zeros,

    C = R_(e-s-1)(b_s) xor ... xor R_0(b_(e-1))                             (3)
    R_0(b) = b x^16 mod P,  R_(k+1)(b) = R_k(b) x^8 mod P

P = x^16 + x^12 + x^5 + 1. Source: Fletcher, IEEE Trans. Comm. COM-30 (1982); Sarwate,
Comm. ACM 31 (1988).
"""

from __future__ import annotations

from binascii import crc_hqx
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fieldcal.drivers.framing import Bytes, Index, byte_rows

FEW_STRETCHES = 32
"""Number of stretches of one length below which no tables are used."""

BYTES_AT_ONCE = 1 << 18
"""Bytes processed at once; limits the memory, since stretches may overlap."""

Words = NDArray[np.uint16]


def byte_sums(data: Bytes, starts: Index, ends: Index) -> Bytes:
    """Sum of the bytes of each stretch modulo 256, (m,), (1).

    >>> data = np.array([1, 2, 255, 3], np.uint8)
    >>> byte_sums(data, np.array([0, 1]), np.array([3, 4]))
    array([2, 4], dtype=uint8)
    """
    edges = np.column_stack([starts, ends]).ravel()
    # a place behind the end, as a stretch may end there
    padded = np.append(data, np.uint8(0))
    total: Bytes = np.add.reduceat(padded, edges, dtype=np.uint8)[::2]  # (1)
    total[starts == ends] = 0
    return total


def word_sums(data: Bytes, starts: Index, ends: Index) -> Words:
    """Sum of the bytes of each stretch modulo 65536, (m,), (1).

    >>> data = np.array([1, 2, 255, 3], np.uint8)
    >>> word_sums(data, np.array([0, 1]), np.array([3, 4]))
    array([258, 260], dtype=uint16)
    """
    if not len(starts):
        return np.empty(0, np.uint16)
    edges = np.column_stack([starts, ends]).ravel()
    padded = np.append(data, np.uint8(0)).astype(np.uint16)
    total: Words = np.add.reduceat(padded, edges, dtype=np.uint16)[::2]  # (1)
    total[starts == ends] = 0
    return total


def fletcher_sums(data: Bytes, starts: Index, ends: Index) -> tuple[Bytes, Bytes]:
    """Fletcher's two sums of each stretch modulo 256, (m,) each, (1), (2).

    >>> fletcher_sums(np.array([9, 1, 2, 3], np.uint8), np.array([1]), np.array([4]))
    (array([6], dtype=uint8), array([10], dtype=uint8))
    """
    weighed = np.arange(len(data), dtype=np.uint8) * data
    first = byte_sums(data, starts, ends)
    second = ends.astype(np.uint8) * first - byte_sums(weighed, starts, ends)  # (2)
    return first, second


def crc16(data: Bytes, starts: Index, ends: Index) -> Words:
    """CRC-16/XMODEM of each stretch, (m,), (3); 0 if it ends with its own.

    >>> digits = np.frombuffer(b"123456789", np.uint8)
    >>> crc16(digits, np.array([0]), np.array([9]))
    array([12739], dtype=uint16)
    """
    found = np.zeros(len(starts), np.uint16)
    sizes, group, counts = np.unique(
        ends - starts, return_inverse=True, return_counts=True
    )
    for i, (size, count) in enumerate(
        zip(sizes.tolist(), counts.tolist(), strict=True)
    ):
        which = np.flatnonzero(group == i)
        if count < FEW_STRETCHES:
            each = (data[starts[k] : ends[k]] for k in which.tolist())
            found[which] = [crc_hqx(stretch.tobytes(), 0) for stretch in each]
            continue
        table, at = _remainders(size), 256 * np.arange(size)[::-1]
        for some in np.array_split(which, 1 + count * size // BYTES_AT_ONCE):
            parts = table.take(byte_rows(data, starts[some], size) + at)
            found[some] = np.bitwise_xor.reduce(parts, axis=1)  # (3)
    return found


@cache
def _remainders(size: int) -> Words:
    """R_k(b) of (3) at 256 k + b, for k < size."""
    first = np.array([crc_hqx(bytes([b]), 0) for b in range(256)], np.uint16)
    table: list[NDArray[Any]] = [first]
    for _ in range(size - 1):
        table.append(table[-1] << 8 ^ first[table[-1] >> 8])
    return np.concatenate(table)
