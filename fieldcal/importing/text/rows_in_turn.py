"""Rows of which some hold the accelerometer or the gyroscope alone.

time,ax,ay,az,gx,gy,gz             two sensors with times of their own, merged by time:
0.000,0.1,0.2,9.8,,,               no row has both, so no row tells how the force turns
0.004,,,,0.01,0.02,0.03            with the rates
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial
from itertools import chain, tee

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.importing.times.alignment import AlignedPair
from fieldcal.importing.times.row_validator import RowValidator
from fieldcal.importing.times.slower_sensor import known_sensors

MIN_ROWS = 20
"""Rows of each sensor that tell."""

MAX_SHARED_ROWS = 0.05
"""Share of the rows with values that has both at most: two times may be the same."""


class RowsInTurn:
    """Makes rows of both sensors.

    Where no row has both, each sample of the accelerometer goes with the nearest of the
    gyroscope. Other rows stay as they are.

    Parameters
    ----------
    name : of the file, for errors
    repair : whether samples whose times cannot be are left out and said, or refused

    Attributes
    ----------
    says : what the user must know, a sentence each
    mended : what was left out, likewise
    told : whether rows are of two sensors

    """

    def __init__(self, name: str, repair: bool) -> None:
        self._name, self._repair = name, repair
        self.says: list[str] = []
        self.mended: list[str] = []
        self.told = False
        self._warm = np.nan

    def through(self, blocks: Iterable[Block]) -> Iterator[Block]:
        """All samples, of both sensors."""
        flow = iter(blocks)
        first = next(flow, None)
        if first is None:
            return
        acc, gyr = known_sensors(first)
        many = (acc & ~gyr).sum(), (gyr & ~acc).sum()
        self.told = min(many) >= MIN_ROWS and (
            acc & gyr
        ).sum() <= MAX_SHARED_ROWS * sum(many)
        if not self.told:
            yield from chain([first], flow)
            return
        yield from self._paired(chain([first], flow))

    def _paired(self, blocks: Iterable[Block]) -> Iterator[Block]:
        """Samples of the accelerometer, each with the nearest of the gyroscope."""
        pair, (first, second) = AlignedPair(), tee(blocks)
        judges = [
            RowValidator(self._name, partial(_sample_of, sensor), self._repair)
            for sensor in ("accelerometer", "gyroscope")
        ]
        flows = map(self._forces, first), map(_rates, second)
        acc, gyr = (j.through(flow) for j, flow in zip(judges, flows, strict=True))
        yield from pair.through(acc, gyr)
        self.mended += [said for judge in judges for said in judge.mended]
        self.says += [said for judge in judges for said in judge.says]
        self.says.append(
            "its rows hold the accelerometer or the gyroscope: each sample of the first"
            f" goes with the nearest, {1e3 * pair.worst:.2g} ms apart at most"
        )

    def _forces(self, block: Block) -> Block:
        """Samples of the accelerometer alone."""
        acc, _ = known_sensors(block)
        warm = self._warmth(block.temperature)[acc]
        return Block.of(block.t[acc], block.acc[acc], None, warm)

    def _warmth(self, values: Array) -> Array:
        """Temperatures (n,), those that are missing as they were last known."""
        held = np.concatenate([[self._warm], values])
        last = np.maximum.accumulate(
            np.where(np.isfinite(held), np.arange(len(held)), 0)
        )
        self._warm = float(held[last[-1]])
        filled: Array = held[last][1:]
        return filled


def _sample_of(sensor: str, number: int) -> str:
    """Name a sample of one sensor, counted from 0."""
    return f"sample {number + 1} of its {sensor}"


def _rates(block: Block) -> Block:
    """Samples of the gyroscope alone."""
    _, gyr = known_sensors(block)
    unknown = np.full((int(gyr.sum()), 3), np.nan)
    return Block.of(block.t[gyr], unknown, block.gyr[gyr])
