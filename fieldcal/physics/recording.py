"""Input and output of the checks of the signal chain."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.once import once_per_block
from fieldcal.core.samples import Array, Block
from fieldcal.physics.experience import Experience

Rows = NDArray[np.intp]

GRID_SAMPLES = 20_000
"""Samples that show the grid that values lie on."""

MAX_GRID_PARTS, MIN_GRID_GAPS = 40, 9
"""Steps in the least gap, up to which they are sought, and gaps that say so for
certain: what a device counts and a program writes in decimals has no two neighbours.
Any gap is within 5 % of a whole number by chance once in ten times."""


REACHES = (4.0, 32.0, 256.0, np.inf)
"""Largest gap that tells a step, in the least gap: each reach tells it better."""

FEW_GAPS = 100
"""Gaps that are looked at before all others."""


@dataclass(frozen=True, slots=True)
class Grids:
    """Steps of the grids of six outputs, by stretch.

    Attributes
    ----------
    starts : (k,) first sample of each stretch; that of the first one is 0
    steps : (k, 6) step in each, SI; 0 where values lie on no grid

    """

    starts: NDArray[np.intp]
    steps: Array

    def within(self, first: int, last: int) -> Array:
        """Largest step among samples, (6,)."""
        largest: Array = self.steps[self._stretches(first, last)].max(axis=0)
        return largest

    def stretches(self, c: int, size: int) -> Iterator[tuple[int, int, float]]:
        """First sample, one past the last, and step, of the stretches of a channel."""
        kept = np.flatnonzero(np.diff(self.steps[:, c], prepend=-1.0))
        ends = [*self.starts[kept[1:]].tolist(), size]
        for k, end in zip(kept.tolist(), ends, strict=True):
            yield int(self.starts[k]), int(end), float(self.steps[k, c])

    @property
    def changed(self) -> NDArray[np.bool_]:
        """Channels whose grid changes, (6,)."""
        out: NDArray[np.bool_] = np.any(self.steps != self.steps[0], axis=0)
        return out

    def _stretches(self, first: int, last: int) -> slice:
        at = np.searchsorted(self.starts, [first, max(last - 1, first)], side="right")
        return slice(int(at[0]) - 1, int(at[1]))


@dataclass(frozen=True, slots=True)
class CheckedSamples:
    """Samples, and what was known about them.

    Attributes
    ----------
    block : the samples, SI
    windows : (p, 2) first and one past the last sample of each position's window
    x : expected inputs in each position, p rows
    scale, bias : (6,) nominal calibration, in `samples.CHANNELS` order
    noise : (6,) standard deviation of one sample, as means over a second obey it
    quick : (6,) the same, as one sample differs from the next
    steps : (6,) step of the grid that all values lie on, 0 where they lie on none
    grids : grids of stretches of the recording
    limits : (2,) full scale of accelerometers and gyroscopes, SI; nan where unknown
    rate_hz : nominal rate; nan where unknown
    without : (start, end) of time of which no sample is known to have been lost on its
        way: what a disturbance spoiled, or what is damaged in the file, s

    """

    block: Block
    windows: Rows
    x: Experience
    scale: Array
    bias: Array
    noise: Array
    quick: Array
    steps: Array
    grids: Grids
    limits: Array
    rate_hz: float
    without: tuple[tuple[float, float], ...] = ()

    @property
    def still(self) -> NDArray[np.bool_]:
        """Samples in one of the windows, (n,)."""
        inside = np.zeros(len(self.block), dtype=bool)
        for first, last in self.windows:
            inside[first:last] = True
        return inside

    def channel(self, c: int) -> Array:
        """Samples of one output by its index in `samples.CHANNELS`, (n,)."""
        triad = self.block.acc if c < 3 else self.block.gyr
        return np.ascontiguousarray(triad[:, c % 3])

    def six(self, first: int, last: int) -> Array:
        """All outputs of some samples, (n, 6), each channel in one piece."""
        out = np.empty((6, last - first))
        out[:3] = self.block.acc[first:last].T
        out[3:] = self.block.gyr[first:last].T
        return out.T

    def mean(self, position: int) -> Array:
        """Mean of the finite samples in a window, (6,); nan without any."""
        first, last = self.windows[position].tolist()
        out = np.full(6, np.nan)
        for c, values in enumerate((*self.block.acc.T, *self.block.gyr.T)):
            some = values[first:last]
            total = some.sum()
            if not np.isfinite(total):
                some = some[np.isfinite(some)]
                total = some.sum()
            if len(some):
                out[c] = total / len(some)
        return out

    def position_of(self, row: int) -> int:
        """Index of the position whose window holds a sample, -1 if none does."""
        inside = (self.windows[:, 0] <= row) & (row < self.windows[:, 1])
        return int(np.argmax(inside)) if inside.any() else -1


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault of samples.

    Attributes
    ----------
    channel : name in `samples.CHANNELS`, "t" or "temperature"
    values : by the effect's parameter name; text where it is no number
    sigmas : standard uncertainty of the values that are numbers
    from_s, to_s : stretch of device time concerned
    rows : (m,) samples of the channel that are not to be used
    size : departure, in the channel's unit
    sigma : significance, in standard deviations
    mended : (n, 6) outputs put right, where they can be
    channels : every channel concerned, if there are several
    angles : what stated angles are to be multiplied by to be right

    """

    channel: str
    values: Mapping[str, float | str]
    sigmas: Mapping[str, float]
    from_s: float
    to_s: float
    rows: Rows = field(default_factory=lambda: np.empty(0, dtype=np.intp))
    size: float = 0.0
    sigma: float = np.inf
    mended: Array | None = None
    channels: tuple[str, ...] = ()
    angles: float = 1.0


def medians(values: Array) -> Array:
    """Median of the finite values in each row, (n,); nan if there are none.

    `numpy.median` looks for nan in each row, which takes four times as long.
    """
    half, odd = divmod(values.shape[1], 2)
    ordered = np.partition(values, half, axis=1)
    upper: Array = ordered[:, half]
    found = upper if odd else (ordered[:, :half].max(axis=1) + upper) / 2
    for i in np.flatnonzero(~np.isfinite(values.sum(axis=1))):
        known = values[i][np.isfinite(values[i])]
        found[i] = np.median(known) if len(known) else np.nan
    return found


def lsb_of(values: Array) -> float:
    """Step of the grid that values lie on, 0 if they lie on none.

    Values of zero are ignored: a program that adds half a step outward to values cut
    off towards zero does not change them.

    >>> round(lsb_of(np.array([0.5, 1.25, -0.25, 1.0])), 12)
    0.25
    >>> round(lsb_of(np.round(np.arange(20) * 2.39e-3, 3)), 12)  # 0.002 and 0.003 apart
    0.001
    """
    # one rest may show two values alone
    return step_between(shown_values(values))


def shown_values(values: Array) -> Array:
    """Values that some of the samples (n,) show, each once, in order."""
    some = values[np.isfinite(values)]
    return np.unique(some[:: shown_in(len(some))])


def shown_in(size: int) -> int:
    """Samples in each of which one is looked at, of so many."""
    return max(1, size // GRID_SAMPLES)


def step_between(shown: Array) -> float:
    """Step of the grid of values that are shown, in order; 0 is not looked at."""
    distinct = shown[shown != 0.0]
    gaps = np.diff(distinct)
    gaps = gaps[gaps > 1e-9 * np.abs(distinct).max(initial=0.0)]
    if len(gaps) < 2:
        return 0.0
    parts = range(1, 1 + (MAX_GRID_PARTS if len(gaps) >= MIN_GRID_GAPS else 1))
    steps = (_grid(gaps, float(gaps.min()) / part) for part in parts)
    return next((step for step in steps if step), 0.0)


def _grid(gaps: Array, step: float) -> float:
    """Step of which all gaps are multiples, about a first guess; 0 if there is none.

    The least gap of a text with few decimals may be some percent off: gaps of a few
    steps tell the step well enough for those of many.
    """
    least = float(gaps.min())
    for reach in REACHES:
        near = gaps[gaps < reach * least]
        most = 0.1 + 0.02 * round(float(near.max()) / step) ** 0.5
        # of what lies on no grid, the first few gaps tell it
        for some in (near[:FEW_GAPS], near) if most < 0.5 else ():
            if _off_grid(some, step) > most:
                return 0.0
        step = float(near.sum()) / float(np.round(near / step).sum())
    return step if _off_grid(gaps, step) < 0.05 else 0.0


def _off_grid(gaps: Array, step: float) -> float:
    """Largest distance of gaps from whole steps, in steps."""
    steps = gaps / step
    return float(np.abs(steps - np.round(steps)).max())


MIN_GRID_VALUES = 4
"""Values of an output below which they show no grid by themselves."""


@once_per_block
def grids_of(block: Block) -> Array:
    """Step of the grid of each output, (6,), 0 where values lie on none.

    An output that shows but one or two values all through has that of its sensor's
    other axes; where none of them shows more, the least change among them.
    """
    steps = np.concatenate([_grids(triad) for triad in (block.acc, block.gyr)])
    steps.setflags(write=False)
    return steps


def _grids(triad: Array) -> Array:
    some = triad[:: shown_in(len(triad))]
    shown = [np.unique(axis[np.isfinite(axis)]) for axis in some.T]
    steps = np.array([step_between(values) for values in shown])
    few = np.array([0 < len(values) < MIN_GRID_VALUES for values in shown])
    known = steps[steps > 0]
    if not len(known):
        known = np.concatenate(
            [np.diff(v) for v in shown if len(v) < MIN_GRID_VALUES] or [known]
        )
    return np.where(few & (steps == 0), min(known, default=0.0), steps)
