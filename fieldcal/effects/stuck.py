"""A channel repeats one value while the others go on.

    U(t) = U(from_s),    from_s <= t < to_s

Found as a run of equal values that chance does not make: with p the share of equal
neighbours elsewhere, a run of k has odds of n p^k. A channel whose steps are coarser
than its noise repeats itself for as long as the device is held; there a run counts only
if it goes on while the device is turned. Source: model of this project.

>>> import numpy as np
>>> values = np.sin(np.arange(500.0))
>>> values[100:140] = values[100]
>>> equal_value_runs(values).tolist()
[[100, 140]]
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import CHANNELS, Array, runs_of_true
from fieldcal.physics.effect import Chain
from fieldcal.physics.recording import CheckedSamples, Fault
from fieldcal.physics.shape import Shape
from fieldcal.windows.dead_axis import dead_sensors

ODDS = 1e-6
MIN_RUNS = 20
"""Smallest number of runs for which their usual length is known."""

MIN_FREE_SHARE = 0.2
"""Smallest part of a window outside a run for which its repeats are known."""

TURNED = 30.0
"""Change of the other axes during a turn, in standard deviations."""

JUMP = 2.5
"""Smallest jump, in steps, at the ends of a run."""

MIN_RUN_SAMPLES = 8
"""Smallest number of equal samples of a run."""


def equal_value_runs(values: Array) -> NDArray[np.intp]:
    """First and one past the last sample of each run of one value, (m, 2)."""
    equal = np.diff(values) == 0
    found = runs_of_true(equal)
    if not len(found):
        return found
    length = found[:, 1] - found[:, 0]
    many = 10 * np.median(length) if len(length) >= MIN_RUNS else 0.0
    usual = length[length <= max(MIN_RUN_SAMPLES, many)]
    often = usual.sum() / max(len(equal) - length.sum() + usual.sum(), 1)
    # a grid coarser than the noise repeats itself: what follows a repeat decides
    again = 1 - len(usual) / usual.sum() if len(usual) else 0.0
    chance = min(max(often, again, 1e-3), 0.999)
    longest = np.log(ODDS / len(values)) / np.log(chance)
    long = found[length + 1 >= max(MIN_RUN_SAMPLES, longest)]
    return np.column_stack([long[:, 0], long[:, 1] + 1])


class Stuck(Chain):
    """Channel that repeats one value."""

    shapes = (Shape("from_s", "s"), Shape("to_s", "s"))
    covariate = "runs of equal values"
    treatment = "mask"
    place = 1
    decided_by = "the stretch recorded again"
    cure = (
        "Restart the device; if it comes back, the sensor is defective. Gyroscopes that"
        " follow the turns and stand at rest are held there by the device (a dead band,"
        " a bias that it tracks): switch that off, it hides their bias."
    )
    source = "model of this project"

    def find(self, recording: CheckedSamples) -> list[Fault]:
        """Runs of equal values in each channel."""
        t, out = recording.block.t, []
        step = float(np.median(np.diff(t)))
        for c, name in enumerate(CHANNELS):
            for first, last in _runs_by_grid(recording, c):
                if _is_explained_by_steps(recording, c, first, last):
                    continue
                begins, ends = float(t[first]), float(t[last - 1] + step)
                out.append(
                    Fault(
                        channel=name,
                        values={"channel": name, "from_s": begins, "to_s": ends},
                        sigmas={"from_s": step, "to_s": step},
                        from_s=begins,
                        to_s=ends,
                        rows=np.arange(first, last),
                        size=float(recording.noise[c]),
                    )
                )
        return out


def _runs_by_grid(recording: CheckedSamples, c: int) -> Iterator[tuple[int, int]]:
    """Runs of equal values, each as it is usual on the grid of its stretch."""
    values = recording.channel(c)
    for start, end, _ in recording.grids.stretches(c, len(values)):
        for first, last in equal_value_runs(values[start:end]).tolist():
            yield start + first, start + last


def _is_explained_by_steps(
    recording: CheckedSamples, c: int, first: int, last: int
) -> bool:
    """Whether coarse steps of the output explain a run of equal values."""
    if last - first == len(recording.block):
        dead = dead_sensors(recording.block.acc, recording.block.gyr)
        return not any(c in one.axes for one in dead if not one.absent)
    step = float(recording.grids.within(first, last)[c])
    step_of = step / max(float(recording.noise[c]), 1e-300)
    # a turn begins slowly: its first samples may read as those of the rest before
    if step_of > 2 and _turned(recording, c, first, last) < MIN_RUN_SAMPLES:
        return True
    return step_of > 1 and _is_usual_for_noise(recording, c, step, first, last)


def _turned(recording: CheckedSamples, c: int, first: int, last: int) -> int:
    """Samples of a run outside windows in which the sensor's other axes show a turn."""
    beside = [i for i in range(c - c % 3, c - c % 3 + 3) if i != c]
    axes = np.array([recording.channel(i)[first:last] for i in beside])
    usual, noise = np.median(axes, axis=1), recording.noise[beside]
    away = np.abs(axes - usual[:, None]) > TURNED * noise[:, None]
    return int((away.any(axis=0) & ~recording.still[first:last]).sum())


def _is_usual_for_noise(
    recording: CheckedSamples, c: int, step: float, first: int, last: int
) -> bool:
    """Whether a run is usual for steps as large as the noise.

    In a window whose mean is amid a step it is none; nor is it between windows as long
    as the other axes show that the device is not turned, or the channel goes on from
    where it stood.
    """
    values = recording.channel(c)
    at = recording.position_of(first)
    if at < 0 or at != recording.position_of(last - 1):
        axes = [i for i in range(c - c % 3, c - c % 3 + 3) if i != c]
        move = [np.ptp(recording.channel(i)[first:last]) for i in axes]
        beside = [values[i] for i in (first - 1, last) if 0 <= i < len(values)]
        jump = np.abs(np.array(beside) - values[first]).max(initial=0.0)
        turned = max(move) > TURNED * recording.noise[axes].max()
        return not (turned and jump > JUMP * step)
    start, end = recording.windows[at]
    equal = np.diff(values[start:end]) == 0
    equal = np.delete(equal, slice(first - start, last - 1 - start))
    if len(equal) < MIN_FREE_SHARE * (end - start):
        return False
    again = (equal.sum() + 1) / (len(equal) + 2)
    odds = np.log(len(recording.block)) + (last - first) * np.log(again)
    return bool(odds > np.log(ODDS))
