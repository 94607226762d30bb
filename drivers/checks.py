"""Checksums of many stretches of bytes at once, from running sums.

With S the running sum of the bytes b_i, and W that of i b_i, all modulo 256, the sums
over a stretch from s to e are

    A = S_e - S_s                                                           (1)
    B = e A - (W_e - W_s), the sum of the running sums                      (2)

A is the plain sum, (A, B) Fletcher's checksum. Source: Fletcher, IEEE Trans. Comm.
COM-30 (1982).
"""

from __future__ import annotations

import numpy as np

from fieldcal.drivers.framing import Bytes, Index


def sums(data: Bytes, starts: Index, ends: Index) -> Bytes:
    """Sum of the bytes of each stretch modulo 256, (m,), (1).

    >>> sums(np.array([1, 2, 255, 3], np.uint8), np.array([0, 1]), np.array([3, 4]))
    array([2, 4], dtype=uint8)
    """
    running = np.zeros(len(data) + 1, np.uint8)
    np.cumsum(data, dtype=np.uint8, out=running[1:])
    total: Bytes = running[ends] - running[starts]
    return total


def fletcher(data: Bytes, starts: Index, ends: Index) -> tuple[Bytes, Bytes]:
    """Fletcher's two sums of each stretch modulo 256, (m,) each, (1), (2).

    >>> fletcher(np.array([9, 1, 2, 3], np.uint8), np.array([1]), np.array([4]))
    (array([6], dtype=uint8), array([10], dtype=uint8))
    """
    weighed = np.arange(len(data), dtype=np.uint8) * data
    first = sums(data, starts, ends)
    second = ends.astype(np.uint8) * first - sums(weighed, starts, ends)
    return first, second
