"""Samples of the FIFO messages of a PX4 log, as if all were of an accelerometer."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array, Block, concat
from fieldcal.importing.messages.ulog_messages import Table
from fieldcal.importing.times.fifo_time import FifoTimes

MAX_FIFO_SAMPLES = 32
"""Samples that a message of a FIFO has room for."""


class FifoReader:
    """Reads the messages of one sensor, table by table.

    The last message is held back until the next one is known: a stamp that leaps ahead
    alone is wrong itself, and its samples have no time; those behind it keep theirs.

    Parameters
    ----------
    stamps : gives the times of a table's messages, s

    """

    def __init__(self, stamps: Callable[[Table], Array]) -> None:
        self._stamps = stamps
        self._times = FifoTimes()
        self._held: Table = {}
        self._before = -np.inf

    def read(self, table: Table) -> Block:
        """Samples of all messages up to the last one."""
        held = self._held
        if held:
            table = {name: np.append(held[name], rows) for name, rows in table.items()}
        self._held = {name: rows[-1:] for name, rows in table.items()}
        t = self._stamps(table)
        behind, t = t[1:], t[:-1]
        ahead = (t > behind) & (behind > np.append(self._before, t)[:-1])
        self._before = float(t[-1]) if len(t) else self._before
        return self._unpacked({n: rows[:-1] for n, rows in table.items()}, ahead)

    def rest(self) -> Block:
        """Samples of the last message."""
        held, self._held = self._held, {}
        return self._unpacked(held, np.zeros(1, dtype=bool)) if held else concat([])

    def _unpacked(self, table: Table, ahead: NDArray[np.bool_]) -> Block:
        number = table["samples"].astype(int).clip(0, MAX_FIFO_SAMPLES)
        some = number > 0
        number, ahead = number[some], ahead[some]
        if not len(number):
            return concat([])
        period = 1e-6 * table["dt"][some].astype(float)
        t = np.full(number.sum(), np.nan)
        if not ahead.all():
            own, read = ~ahead, self._stamps(table)[some]
            t[np.repeat(own, number)] = self._times.times(
                read[own], number[own], period[own]
            )
        valid = np.arange(MAX_FIFO_SAMPLES) < number[:, None]
        scale = np.repeat(table["scale"][some].astype(float), number)
        axes = [_samples(table, axis)[some][valid] for axis in "xyz"]
        return Block.of(t, scale[:, None] * np.column_stack(axes))


def _samples(table: Table, axis: str) -> Array:
    """Numbers (n, 32) of an axis."""
    columns = [table[f"{axis}[{i}]"] for i in range(MAX_FIFO_SAMPLES)]
    with np.errstate(invalid="ignore"):  # of a nan that signals
        return np.column_stack([np.asarray(one, dtype=float) for one in columns])
