"""What the checks of the signal chain look at, and what they report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fieldcal.effects.experience import Experience
from fieldcal.samples import Array, Block

Rows = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Recording:
    """Samples, and what was known about them.

    Attributes
    ----------
    block : the samples, SI
    windows : (p, 2) first and one past the last sample of each position's window
    x : what each position should bring about, p rows
    scale, bias : (6,) nominal calibration, in `samples.CHANNELS` order
    noise : (6,) standard deviation of one sample from short-lag differences
    limits : (2,) full scale of accelerometers and gyroscopes, SI; nan where unknown
    rate_hz : nominal rate; nan where unknown

    """

    block: Block
    windows: Rows
    x: Experience
    scale: Array
    bias: Array
    noise: Array
    limits: Array
    rate_hz: float

    @property
    def still(self) -> NDArray[np.bool_]:
        """Samples in one of the windows, (n,)."""
        inside = np.zeros(len(self.block), dtype=bool)
        for first, last in self.windows:
            inside[first:last] = True
        return inside

    def position_of(self, row: int) -> int:
        """Index of the position whose window holds a sample, -1 if none does."""
        inside = (self.windows[:, 0] <= row) & (row < self.windows[:, 1])
        return int(np.argmax(inside)) if inside.any() else -1


@dataclass(frozen=True, slots=True)
class Fault:
    """Something that happened to samples.

    Attributes
    ----------
    channel : name in `samples.CHANNELS`, "t" or "temperature"
    values : by the effect's parameter name; text where it is no number
    sigmas : standard uncertainty of the values that are numbers
    from_s, to_s : stretch of device time concerned
    rows : (m,) samples of the channel that are not to be used
    size : departure, in the channel's unit
    sigma : significance, in standard deviations

    """

    channel: str
    values: Mapping[str, float | str]
    sigmas: Mapping[str, float]
    from_s: float
    to_s: float
    rows: Rows = field(default_factory=lambda: np.empty(0, dtype=np.intp))
    size: float = 0.0
    sigma: float = np.inf
