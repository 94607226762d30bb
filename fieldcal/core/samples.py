"""Raw samples in SI units and device axes, as drivers deliver them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]

Index = NDArray[np.intp]

Mask = NDArray[np.bool_]

CHANNELS = ("ax", "ay", "az", "gx", "gy", "gz")
UNITS = ("m/s^2",) * 3 + ("rad/s",) * 3
ACC, GYR = slice(0, 3), slice(3, 6)
"""Channels of each triad."""


NOT_A_NUMBER = np.array(np.nan)

IMPOSSIBLE_RATE_HZ = 1e6
"""Sampling rate that no IMU reaches: the times are in another unit than s."""


def impossible_rate_text(rate_hz: float) -> str:
    """Error text for a sampling rate that no device has; empty for a possible one.

    >>> impossible_rate_text(200.0)
    ''
    """
    if not rate_hz > IMPOSSIBLE_RATE_HZ:
        return ""
    return (
        f"its samples come {rate_hz:.2g} times a second, which no IMU does: the times"
        " are in another unit than s; import the recording again with --time-unit"
    )


def common_unit(names: Iterable[str]) -> str | None:
    """Unit of all names; "" for names that are no channels, None if units differ.

    >>> common_unit(["ax", "az"]), common_unit(["t"]), common_unit(["ax", "gx"])
    ('m/s^2', '', None)
    """
    units = {UNITS[CHANNELS.index(n)] if n in CHANNELS else "" for n in names}
    return units.pop() if len(units) == 1 else None


@dataclass(frozen=True, slots=True, weakref_slot=True, eq=False)
class Block:
    """Consecutive samples of one IMU, uncalibrated; nan where a value is unknown.

    Attributes
    ----------
    t : (n,) s, device clock, strictly increasing
    acc : (n, 3) m/s^2, accelerometer outputs
    gyr : (n, 3) rad/s, gyroscope outputs
    temperature : (n,) deg C
    seq : (n,) device sequence counter
    t_host : (n,) s, host arrival

    """

    t: Array
    acc: Array
    gyr: Array
    temperature: Array
    seq: Array
    t_host: Array

    @classmethod
    def of(
        cls,
        t: Array,
        acc: Array,
        gyr: Array | None = None,
        temperature: Array | None = None,
        seq: Array | None = None,
        t_host: Array | None = None,
    ) -> Block:
        """Build a block; columns that are not given are nan and read-only."""
        n = len(t)

        def double(values: Array) -> Array:
            # a signalling nan of single precision, as a damaged file has it, is a nan
            with np.errstate(invalid="ignore"):
                return np.asarray(values, dtype=float)

        def known(values: Array | None, shape: tuple[int, ...]) -> Array:
            return (
                np.broadcast_to(NOT_A_NUMBER, shape)
                if values is None
                else double(values)
            )

        return cls(
            double(t),
            double(acc),
            known(gyr, (n, 3)),
            known(temperature, (n,)),
            known(seq, (n,)),
            known(t_host, (n,)),
        )

    def __len__(self) -> int:
        return len(self.t)

    @property
    def six(self) -> Array:
        """Accelerometers and gyroscopes side by side, (n, 6), in `CHANNELS` order."""
        return np.hstack([self.acc, self.gyr])

    def with_six(self, six: Array) -> Block:
        """The block with other outputs (n, 6), in `CHANNELS` order."""
        return replace(self, acc=six[:, ACC], gyr=six[:, GYR])

    def between(self, start: float, end: float) -> Block:
        """Samples with start <= t < end, s of device time."""
        first, last = np.searchsorted(self.t, [start, end])
        return self[int(first) : int(last)]

    def __getitem__(self, rows: slice | Index) -> Block:
        return Block(*(getattr(self, f.name)[rows] for f in fields(Block)))


@dataclass(frozen=True, slots=True)
class Grain:
    """Step to which a device rounds its outputs, as far as the device states it.

    Attributes
    ----------
    acc, gyr : steps of the outputs, m/s^2 and rad/s; 0 where not known
    cut : whether it rounds toward zero; outputs are then corrected by half a step

    """

    acc: float = 0.0
    gyr: float = 0.0
    cut: bool = False

    @property
    def step(self) -> Array:
        """Step of each channel, (6,); 0 where not known."""
        return np.repeat([self.acc, self.gyr], 3)


def concat(blocks: Iterable[Block]) -> Block:
    """Join blocks in time order; no block at all gives an empty one."""
    parts = list(blocks)
    if not parts:
        return Block.of(np.empty(0), np.empty((0, 3)))
    return Block(
        *(np.concatenate([getattr(b, f.name) for b in parts]) for f in fields(Block))
    )


def split_by_time(block: Block, seconds: float) -> Iterator[Block]:
    """Parts of a block of `seconds` s of device time each; the last may be shorter."""
    edges = np.arange(block.t[0] + seconds, block.t[-1], seconds)
    rows = [0, *np.searchsorted(block.t, edges).tolist(), len(block)]
    for first, last in pairwise(rows):
        if last > first:
            yield block[first:last]


def runs_of_true(flags: NDArray[np.bool_]) -> NDArray[np.intp]:
    """First and one past the last of each run of True, (m, 2).

    >>> runs_of_true(np.array([False, True, True, False, True])).tolist()
    [[1, 3], [4, 5]]
    """
    padded = np.concatenate([[False], flags, [False]]).astype(np.int8)
    steps = np.diff(padded)
    return np.column_stack([np.flatnonzero(steps == 1), np.flatnonzero(steps == -1)])
