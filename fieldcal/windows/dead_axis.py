"""Axes without a signal in the whole recording; their sensor cannot be used.

Examples are a broken wire, a column of zeros, and a device without gyroscopes that
sends zeros instead. A force or a turn needs all three axes of its sensor.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from fieldcal.core.samples import ACC, CHANNELS, GYR, Array, Block
from fieldcal.core.sentences import join_words
from fieldcal.windows.cells import CellRows, SamplesBetween

MIN_CHANGING_SHARE = 0.5
"""Least part of samples that differ from the previous one if noise exceeds the step."""

_PART = 1 << 12
"""Number of cells that are read at a time."""

_SUMS, _FINEST = (1, 7, 13, 19), slice(27, 33)
"""Columns of `CellRows`: the first of each of the sums n, S, D and m, and the smallest
changes of the six channels."""


class DeadSensor(NamedTuple):
    """A sensor that cannot be used.

    Attributes
    ----------
    channels : its three, in `CHANNELS`
    axes : those without a signal, in `CHANNELS`
    message : a sentence for the user

    """

    channels: slice
    axes: tuple[int, ...]
    message: str

    @property
    def absent(self) -> bool:
        """Whether none of its axes has a signal."""
        return len(self.axes) == len("xyz")


def dead_sensors(acc: Array, gyr: Array) -> list[DeadSensor]:
    """Recorded sensors that have an axis without a signal.

    Such an axis is missing, or it never changes while the other axes are noisier than
    their steps. If the other axes are coarse as well, the axis may be intact and just
    never have been turned.

    Parameters
    ----------
    acc, gyr : (n, 3) samples, nan where missing

    """
    dead = []
    for sensor, channels, triad in (
        ("accelerometers", ACC, acc),
        ("gyroscopes", GYR, gyr),
    ):
        axes = _dead_axes(triad)
        if not axes:
            continue
        names = [CHANNELS[channels][axis] for axis in axes]
        what = "never change, or are missing"
        if len(names) == 1:
            what = "never changes, or is missing"
        message = f"the {sensor} are not used: {join_words(names)} {what}"
        numbers = tuple(channels.start + axis for axis in axes)
        dead.append(DeadSensor(channels, numbers, message))
    return dead


def broken_axis_messages(block: Block) -> list[str]:
    """Sentences about recorded axes that never change while the other axes do.

    A missing column may be intended. A value that never changes means that a wire or a
    sensor is broken.
    """
    messages = []
    outputs = (*block.acc.T, *block.gyr.T)
    for sensor in dead_sensors(block.acc, block.gyr):
        shown = [a for a in sensor.axes if np.isfinite(outputs[a]).any()]
        stuck = [] if sensor.absent else shown
        if not stuck:
            continue
        names = [CHANNELS[a] for a in stuck]
        change = "change" if len(names) > 1 else "changes"
        messages.append(
            f"{join_words(names)} never {change} while the rest of the sensor does: a"
            " wire or the sensor is broken; repair it and record again"
        )
    return messages


def _dead_axes(triad: Array) -> list[int]:
    """Axes of a sensor without a signal; none if the sensor was not recorded."""
    shares = np.array([_share_of_changes(axis) for axis in triad.T])
    if np.isnan(shares).all():
        return []
    still = ~(shares > 0)
    if still.all():
        return [0, 1, 2]
    dead = np.isnan(shares) | (still & (still | (shares > MIN_CHANGING_SHARE)).all())
    return [int(axis) for axis in np.flatnonzero(dead)]


def _share_of_changes(values: Array) -> float:
    """Part of the values (n,) that differ from the previous one; nan without values."""
    known = values[np.isfinite(values)]
    if not len(known):
        return np.nan
    return float(np.mean(known[1:] != known[:-1])) if len(known) > 1 else 0.0


def without_dead_axes(block: Block, sensors: Sequence[DeadSensor]) -> Block:
    """Samples with nan for the axes without a signal; the block itself without any.

    The other axes of such a sensor still show whether the device is at rest.
    """
    dead = [axis for sensor in sensors for axis in sensor.axes]
    if not dead:
        return block
    kept = block.six
    kept[:, dead] = np.nan
    return block.with_six(kept)


class LiveAxisRows:
    """Rows of all cells, with axes that never change treated as not recorded.

    Parameters
    ----------
    rows : of a recording

    """

    def __init__(self, rows: CellRows) -> None:
        changed = np.zeros(6, dtype=bool)
        for first in range(0, len(rows), _PART):
            part = rows[first : first + _PART]
            changed |= np.isfinite(part[:, _FINEST]).any(axis=0)
        self._rows = rows
        # if no axis ever changes, all are kept
        self._dead = np.flatnonzero(~changed) if changed.any() else np.arange(0)

    def __len__(self) -> int:
        """Count the cells."""
        return len(self._rows)

    def __getitem__(self, some: slice, /) -> Array:
        """Return the cells of a slice, (k, 35)."""
        rows = self._rows[some]
        if len(self._dead):
            rows = rows.copy()
            rows[:, [first + c for c in self._dead for first in _SUMS]] = 0.0
        return rows

    def samples_without_dead_axes(self, between: SamplesBetween) -> SamplesBetween:
        """The function `between`, with nan for axes that never change."""

        def living(start: float, end: float) -> Iterator[Block]:
            for block in between(start, end):
                six = block.six
                six[:, self._dead] = np.nan
                yield block.with_six(six)

        return living if len(self._dead) else between
