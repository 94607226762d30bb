"""Rates at rest in the windows, and how long the device rests before and after them.

A window is cut into a few means over equal numbers of samples. Their noise is that of
the samples at high frequencies, which a removal of the bias leaves as it is.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.samples import Array, Block, Index

CELLS = 12
"""Largest number of means in a window."""

SPECTRUM, OCTAVES, FILTERS = 16, 4, 4.0
"""Fewest samples of a periodogram and powers of an octave; number of octaves; standard
deviations by which an octave below the band of a filter has more power."""

PIECE_S = 0.25
"""Length of the means between windows, s, which tell when the device begins to turn."""

NEAR = 4
"""Number of such means at the end of a window, with which they are compared."""

TURNS, NOISES = 2e-3, 8.0
"""Least rate of a turn about an axis, rad/s, and in standard deviations of a mean."""

LOST_S = 0.5
"""Time without samples, s, in which a device may have been off."""


@dataclass(frozen=True, slots=True)
class RestStep:
    """A time of rest; before it, the device may have been turned.

    Attributes
    ----------
    seconds : its length, s; 0 if the turn alone is known
    since_turn : when it began, s after the last turn, or after the first window began
    rates : (..., a) rad/s, mean rates; nan where none are known
    turned : whether the device was turned before it
    lost : whether samples are missing there for so long that it may have been off

    `seconds` and `since_turn` of several ways to cut a window have a last axis of 1.

    """

    seconds: float | Array
    since_turn: float | Array
    rates: Array
    turned: bool = False
    lost: bool = False


@dataclass(frozen=True, slots=True)
class Stop:
    """A window in which the device rests, between two turns.

    Attributes
    ----------
    window : its samples
    noise : (a,) rad/s, noise of a sample; nan where there is none
    settled : time at rest before it since a turn, s; 0 before the first window
    stays : time at rest after it, s
    turned : whether the device was turned before it
    lost : whether samples are missing there for so long that it may have been off

    """

    window: Block
    noise: Array
    settled: float = 0.0
    stays: float = 0.0
    turned: bool = False
    lost: bool = False

    def enclosed(self, steps: Iterable[RestStep]) -> Iterator[RestStep]:
        """Steps of the window, with the rest before and after it."""
        unknown = np.full(len(self.noise), np.nan)
        if self.turned:
            yield RestStep(self.settled, 0.0, unknown, turned=True, lost=self.lost)
        yield from steps
        if self.stays:
            since = self.settled + self.window.t[-1] - self.window.t[0]
            yield RestStep(self.stays, since, unknown)


def stops_at_rest(held: Sequence[Block], block: Block, noise: Array) -> list[Stop]:
    """Stops with the windows of a block; `noise` is that of `noise_of_samples`."""
    largest = float(np.nanmax(noise, initial=0.0))
    stops: list[Stop] = []
    for one, own in zip(held, noise, strict=True):
        if not stops:
            stops.append(Stop(one, own))
            continue
        stays, settled, lost = _between(stops[-1].window, one, block, largest)
        stops[-1] = replace(stops[-1], stays=stays)
        stops.append(Stop(one, own, settled, turned=True, lost=lost))
    return stops


def rest_steps(stops: Sequence[Stop], axes: Index) -> list[RestStep]:
    """Steps of rest of some axes, in the order of time."""
    return [step for stop in stops for step in stop.enclosed(_cells(stop, axes))]


def noise_of_samples(held: Sequence[Block], axes: Index) -> Array:
    """White noise of a sample in windows, (w, a) rad/s; nan where there is none."""
    noise = np.array([white_noise(one.gyr[:, axes]) for one in held])
    return np.where(noise > 0, noise, np.nan)


def sample_period(one: Block) -> float:
    """Usual time between two samples, s."""
    return float(np.median(np.diff(one.t)))


def _cells(stop: Stop, axes: Index) -> Iterator[RestStep]:
    """Means of a window."""
    one = stop.window
    each = -(-len(one) // CELLS)
    count = len(one) // each
    means = one.gyr[: count * each, axes].reshape(count, each, -1).mean(axis=1)
    means[:, np.isnan(stop.noise)] = np.nan
    seconds = each * sample_period(one)
    for k, mean in enumerate(means):
        yield RestStep(seconds, stop.settled + k * seconds, mean)


def _between(
    before: Block, after: Block, block: Block, noise: float
) -> tuple[float, float, bool]:
    """Rest after a window until a turn, and before the next, s; if samples are lost."""
    first, last = np.searchsorted(block.t, [before.t[-1], after.t[0]]).tolist()
    gap = block[first + 1 : last]
    lost = bool(np.diff(block.t[first : last + 1]).max(initial=0.0) > LOST_S)
    each = max(round(PIECE_S / sample_period(before)), 1)
    count = len(gap) // each
    means = gap.gyr[: count * each].reshape(count, each, 3).mean(axis=1)
    bound = max(TURNS, NOISES * noise / np.sqrt(each))

    def pieces_at_rest(window: Block, way: int) -> int:
        beside = window.gyr[::-way][: NEAR * each].mean(axis=0)
        off = np.nan_to_num(np.abs(means - beside).max(axis=1))
        return int(np.argmin(np.append(off[::way] < bound, False)))

    rested = pieces_at_rest(before, 1)
    settled = pieces_at_rest(after, -1) if rested < count else 0
    return rested * PIECE_S, settled * PIECE_S, lost


def white_noise(gyr: Array) -> Array:
    """White noise of a sample, (3,); before a filter, if there is one.

    A filter, or a program that interpolates samples, leaves less power in the upper
    octaves than in those below. The median of m powers scatters by its 1.44 m^-1/2.
    """
    power = np.abs(np.fft.rfft(gyr - gyr.mean(axis=0), axis=0)[1:-1]) ** 2
    level: Array = np.median(power, axis=0)
    for k in range(1, OCTAVES):
        octave = power[len(power) >> (k + 1) : len(power) >> k]
        if len(octave) < SPECTRUM:
            break
        own, scatters = np.median(octave, axis=0), 1.44 / np.sqrt(len(octave))
        level = np.where(own > (1 + FILTERS * scatters) * level, own, level)
    return np.asarray(np.sqrt(level / len(gyr) / np.log(2.0)))
