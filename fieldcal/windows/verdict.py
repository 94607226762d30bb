"""Whether the device moved during a window: when, on which axis and how."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fieldcal.core.errors import Moved
from fieldcal.core.samples import CHANNELS, Array
from fieldcal.windows.cells import CELL, CellTable
from fieldcal.windows.disturbance import (
    DisturbanceStatistic,
    Kind,
    LeastSpread,
    pushes,
    repeats,
    shakes,
    steps,
)
from fieldcal.windows.limits import StillnessLimits
from fieldcal.windows.quiet import QuietNoise, estimate_quiet_noise
from fieldcal.windows.rounding import largest_deviation, variance_of_mean
from fieldcal.windows.trend import drift_course, robust_lines

THRESHOLD, LONG = 5.8, 600
"""Ratio of departure to spread that noise alone does not reach, in a window of `LONG`
cells, a minute."""

FEWEST_JUDGED_CELLS = 30
"""Cells from which the usual noise of a window is known: 3 s, or as many samples where
they come less often than cells."""

EARLY_WINDOW_S = 8.0
"""The threshold is twice as high in a window this long, s, for lack of data."""

MEAN_ROUNDING = 1e-6
"""Relative error of a mean of equal values, of which a jump of one step consists."""

_PRESENT = 10
"""Cells of the last second."""


@dataclass(frozen=True, slots=True)
class Departure:
    """Where and by how much a window departs most from rest.

    Attributes
    ----------
    ratio : departure over the allowed one; above 1 is a disturbance
    kind : kind of disturbance
    channel : index in `CHANNELS`
    at, seconds : start, s of device time, and duration, s
    size, noise : departure and its standard deviation by noise, SI

    """

    ratio: float
    kind: Kind | Literal["drift", "noise", "stuck"]
    channel: int
    at: float
    seconds: float
    size: float
    noise: float

    def as_error(self, start: float) -> Moved:
        """Return the error for a window that began at `start`, s of device time."""
        axis = CHANNELS[self.channel]
        unit = "m/s²" if self.channel < 3 else "rad/s"
        size = f"{self.size:+.2g} ± {self.noise:.1g} {unit}"
        when = f"disturbed {self.at - start:.1f} s into the window on {axis}"
        noise = f"where the noise is {self.noise:.1g} {unit}"
        if self.noise > 0:
            noise = f"{abs(self.size) / self.noise:.0f} times the noise"
        says = {
            "push": f"{when}: a {self.seconds:.1f} s push of {size}, {noise}",
            "step": f"{when}: a lasting change of {size}, {noise}",
            "shake": f"{when}: shaken for {self.seconds:.1f} s by {self.size:.2g} "
            f"{unit}, {noise}",
            "drift": f"creeping on {axis}: {size} over the window",
            "noise": f"moving on {axis} by {self.size:.2g} {unit}, which no device at "
            "rest does",
            "stuck": f"{axis} repeats one value for {self.seconds:.1f} s from "
            f"{self.at - start:.1f} s into the window: its sensor is stuck",
        }
        return Moved(says[self.kind], self.at, axis, self.seconds)


@dataclass(frozen=True, slots=True)
class WindowVerdict:
    """Result of the test for rest, for the samples so far.

    Attributes
    ----------
    worst : the largest departure so far
    ratio_now : the largest ratio of the last second
    quiet : the noise, for the window that follows

    """

    worst: Departure
    ratio_now: float
    quiet: QuietNoise | None


def judge_window(
    cells: CellTable,
    limits: StillnessLimits,
    before: QuietNoise | None = None,
    visible_steps: Array | None = None,
) -> WindowVerdict:
    """Test the samples so far for rest, by their noise and that of earlier windows.

    `visible_steps` (6,) are the jumps by rounding alone, where the device states its
    rounding.
    """
    m = cells.complete_count
    if m < FEWEST_JUDGED_CELLS or m * cells.period < limits.unjudged_s:
        scatter = np.nan_to_num(cells.means[:m]).std(axis=0) if m else np.zeros(6)
        return WindowVerdict(_noise_departure(cells, scatter, limits), 0.0, before)
    means = cells.steady_means[:m]
    noise = estimate_quiet_noise(means, before)
    allowed = _threshold(m) * (1 + (EARLY_WINDOW_S / (CELL * noise.cells)) ** 2)
    jumps = (
        cells.rounding
        if visible_steps is None
        else np.maximum(cells.rounding, visible_steps)
    )
    lines = robust_lines(
        means, cells.resolution / np.maximum(_samples_per_cell(cells), 1.0)
    )
    least = np.maximum((1 + MEAN_ROUNDING) * jumps / allowed, _rounding_noise(cells))
    tests = _disturbance_statistics(
        cells, means, lines, noise, _least_spreads(cells, least)
    )
    worst = [_worst_departure(cells, test, allowed) for test in tests] + _stuck_runs(
        cells
    )
    worst.append(_drift_departure(cells, lines, noise, limits))
    worst.append(_noise_departure(cells, noise.spread[0], limits))
    recent = [test.z[-_PRESENT:].max() for test in tests if test.cells < _PRESENT]
    return WindowVerdict(
        max(worst, key=lambda departure: departure.ratio),
        float(max(recent) / allowed),
        noise,
    )


def _threshold(cells: int) -> float:
    """`THRESHOLD`, raised for a window of more cells than `LONG`.

    The largest of n normal deviates grows as sqrt(2 ln n).
    """
    return float(np.sqrt(THRESHOLD**2 + 2 * np.log(max(1.0, cells / LONG))))


def _disturbance_statistics(
    cells: CellTable, means: Array, lines: Array, noise: QuietNoise, least: LeastSpread
) -> list[DisturbanceStatistic]:
    m = len(means)
    return [
        *pushes(means - lines, noise, least),
        *steps(means - drift_course(means, lines), noise, least),
        *shakes(
            np.nan_to_num(cells.short_lag_variance[:m]), cells.step_counts[:m], least
        ),
    ]


def _rounding_noise(cells: CellTable) -> Array:
    """Error of a mean by rounding, where noise does not average it out, (6,)."""
    return np.sqrt(variance_of_mean(cells.resolution, np.nan_to_num(cells.noise)))


def _least_spreads(cells: CellTable, always: Array) -> LeastSpread:
    """Lower bounds of the spreads, from `always` and from how often values change.

    A cell in which a value jumps by many steps counts as one with changes throughout.
    """
    step, differ = cells.resolution, cells.step_counts
    unit = np.where(step > 0, step, np.inf) ** 2
    share = np.minimum(2 * np.nan_to_num(cells.short_lag_variance) / unit, 1.0)
    changed = (share * differ).sum(axis=0) / np.maximum(differ.sum(axis=0), 1.0)
    return LeastSpread(
        always, largest_deviation(step, changed), _samples_per_cell(cells)
    )


def _samples_per_cell(cells: CellTable) -> Array:
    """Samples that a cell usually has, (6,)."""
    number: Array = np.median(cells.counts, axis=0)
    return number


def _stuck_runs(cells: CellTable) -> list[Departure]:
    """Runs of one value, where the axes of a sensor are noisier than its resolution."""
    sampled = np.nan_to_num(cells.noise)
    sensor = np.repeat(np.median(sampled.reshape(2, 3), axis=1), 3)
    noisy = np.flatnonzero(np.maximum(sampled, sensor) > cells.resolution)
    runs = repeats(np.nan_to_num(cells.short_lag_variance), cells.step_counts, noisy)
    return [
        Departure(
            np.inf,
            "stuck",
            channel,
            float(cells.times[first]),
            float(cells.times[end - 1] + cells.period - cells.times[first]),
            0.0,
            float(sampled[channel]),
        )
        for channel, first, end in runs
    ]


def _worst_departure(
    cells: CellTable, test: DisturbanceStatistic, allowed: float
) -> Departure:
    first, channel = divmod(int(np.argmax(test.z)), test.z.shape[1])
    cell = first + test.cells if test.kind == "step" else first
    return Departure(
        float(test.z[first, channel] / allowed),
        test.kind,
        channel,
        float(cells.times[cell]),
        cells.period * test.cells,
        float(test.size[first, channel]),
        float(test.noise[channel]),
    )


def _drift_departure(
    cells: CellTable, lines: Array, noise: QuietNoise, limits: StillnessLimits
) -> Departure:
    """Change of the line over the window, against the limit and the noise."""
    change = lines[-1] - lines[0]
    ratio = np.abs(change) / (limits.drift + THRESHOLD * noise.allan[-1])
    channel = int(np.argmax(ratio))
    return Departure(
        float(ratio[channel]),
        "drift",
        channel,
        float(cells.times[0]),
        cells.seconds,
        float(change[channel]),
        float(noise.allan[-1][channel]),
    )


def _noise_departure(
    cells: CellTable, scatter: Array, limits: StillnessLimits
) -> Departure:
    ratio = scatter / limits.noise
    channel = int(np.argmax(ratio))
    means = np.abs(np.nan_to_num(cells.means[:, channel]))
    return Departure(
        float(ratio[channel]),
        "noise",
        channel,
        float(cells.times[int(np.argmax(means))]) if len(means) else np.nan,
        cells.period,
        float(scatter[channel]),
        float(limits.noise[channel]),
    )
