"""Columns of a gyroscope with times of their own, beside those of the accelerometer.

    acc_time,acc_x,acc_y,acc_z,gyro_time,gyro_x,gyro_y,gyro_z
    X [s],ACC.X,ACC.Y,ACC.Z,X [s],GYRO.X,GYRO.Y,GYRO.Z

Rows of such a table are no moments: the sensors may have other rates, and one of them
ends before the other. Each sample of the accelerometer goes with the gyroscope's
nearest in time, within half a period; nothing is interpolated.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block
from fieldcal.importing.columns import SKIP
from fieldcal.importing.headings.heading import Column
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.tables.column_times import keeps_growing
from fieldcal.importing.times.alignment import AlignedPair
from fieldcal.importing.times.row_validator import RowValidator
from fieldcal.importing.words.heading_words import heading_meaning

COMMON = 0.5
"""Part of the time that both clocks have to cover, if they are one."""


class OwnTimes(NamedTuple):
    """Columns of the times of both sensors, by their numbers."""

    force: int
    rate: int

    def options(self, wanted: ReadOptions) -> tuple[ReadOptions, ReadOptions]:
        """Options that read each sensor alone: the accelerometer, the gyroscope.

        >>> both = OwnTimes(0, 2).options(ReadOptions(("t", "ax", "_", "gx")))
        >>> [one.columns for one in both]
        [('t', 'ax', '_', '_'), ('_', '_', 't', 'gx')]
        """
        bare = [SKIP if name == "t" else name for name in wanted.columns]
        rates = [name if name[0] == "g" else SKIP for name in bare]
        forces = [SKIP if name[0] == "g" else name for name in bare]
        forces[self.force] = rates[self.rate] = "t"
        force, rate = (replace(wanted, columns=tuple(c)) for c in (forces, rates))
        return force, rate


def own_times(
    columns: Sequence[Column], at: Mapping[str, int], table: Array
) -> OwnTimes | None:
    """Times of each sensor; None where both have one time.

    Parameters
    ----------
    columns : of the file
    at : number of each channel's column
    table : (n, k) numbers of the first rows

    """
    if not {"t", "ax", "gx"} <= at.keys() or len(columns) != table.shape[1]:
        return None
    said = {i: heading_meaning(c.name, c.unit) for i, c in enumerate(columns)}
    times = {i: one for i, one in said.items() if one is not None and one.kind == "t"}
    of_words = {i: _sensor(one.label) for i, one in times.items()}
    before = {
        k: min(at[c] for c in (k + x for x in "xyz") if c in at) - 1 for k in "ag"
    }
    found = []
    for kind in "ag":
        named = [i for i, sensor in of_words.items() if sensor == kind]
        beside = [i for i in times if i == before[kind] and not of_words[i]]
        found += (named or beside)[:1]
    if len(found) < len("ag"):
        return None
    force, rate = found
    alike = times[force].unit == times[rate].unit
    one, other = table[:, force], table[:, rate]
    return OwnTimes(force, rate) if alike and _differ(one, other) else None


def _sensor(label: Sequence[str]) -> str:
    """Kind of the sensor that words name, a or g; "" if none."""
    said = heading_meaning(" ".join((*label, "x"))) if label else None
    return said.kind if said is not None and said.kind in ("a", "g") else ""


def _differ(one: Array, other: Array) -> bool:
    """Whether times (n,) are of one clock, and not the same."""
    if np.array_equal(one, other, equal_nan=True):
        return False
    if not (keeps_growing(one) and keeps_growing(other)):
        return False
    ends = [(np.nanmin(t), np.nanmax(t)) for t in (one, other)]
    both = min(b for _, b in ends) - max(a for a, _ in ends)
    return bool(both > COMMON * max(b - a for a, b in ends))


class SensorsApart:
    """Pairs the samples of both sensors.

    Parameters
    ----------
    name : of the file
    judges : of the rows of the accelerometer, and of the gyroscope

    Attributes
    ----------
    began : time of the first sample, s; nan before it

    """

    def __init__(self, name: str, judges: Sequence[RowValidator]) -> None:
        self._name, self._judges = name, judges
        self._pair, self._together = AlignedPair(), False
        self.began = np.nan

    def through(self, acc: Iterable[Block], gyr: Iterable[Block]) -> Iterator[Block]:
        """All samples of the accelerometer, at its own times.

        Raises
        ------
        InputError
            If the gyroscope has none at any of them.

        """
        flows = (
            judge.through(map(_with_values, flow))
            for judge, flow in zip(self._judges, (acc, gyr), strict=True)
        )
        for block in self._pair.through(*flows):
            if np.isnan(self.began) and len(block):
                self.began = float(block.t[0])
            self._together |= bool(np.isfinite(block.gyr).any())
            yield block
        if not self._together:
            raise InputError(
                f"{self._name}: its gyroscopes have times of their own, and no sample"
                " at any of the accelerometers': say by --columns which column is the"
                " time of both"
            )

    @property
    def sentence(self) -> str:
        """How the sensors were put together."""
        return (
            "its accelerometers and gyroscopes have times of their own: each sample of"
            f" the first goes with the nearest, {1e3 * self._pair.worst:.2g} ms apart"
            " at most"
        )


def _with_values(block: Block) -> Block:
    """Rows that hold anything of this sensor: the other may have more of them."""
    values = np.column_stack([block.t, block.six, block.temperature])
    return block[np.flatnonzero(np.isfinite(values).any(axis=1))]
