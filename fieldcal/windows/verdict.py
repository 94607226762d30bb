"""Test of a window for rest: whether the device moved, when, on which axis and how.

The statistics of module `disturbance`, the drift over the window and its noise are each
compared with what is allowed; the largest ratio decides. Cells are 0.1 s of device
time; c channels in `CHANNELS` order, SI.
"""

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

THRESHOLD, THRESHOLD_CELLS = 5.8, 600
"""Ratio of departure to its standard deviation that noise alone does not reach, in a
window of `THRESHOLD_CELLS` cells: a minute."""

FEWEST_JUDGED_CELLS = 30
"""Number of cells from which a window is tested, since its noise is known: 3 s, or as
many samples if samples come less often than cells."""

EARLY_WINDOW_S = 8.0
"""Length of the windows so far, s, at which the threshold is doubled because their
noise is uncertain. The addition falls with the square of the length."""

MEAN_ROUNDING = 1e-6
"""Relative numerical error of a mean of equal values. A jump of one step of the output
is a difference of two such means, and must not exceed the bound by this error."""

_LAST_SECOND = 10
"""Number of cells in the last second."""


@dataclass(frozen=True, slots=True)
class Departure:
    """A departure of a window from rest: kind, channel, time and size.

    Attributes
    ----------
    ratio : departure over the allowed departure; above 1 it is a disturbance
    kind : kind of disturbance
    channel : index in `CHANNELS`
    at, seconds : its start, s of device time, and its duration, s
    size, noise : departure, and its standard deviation by noise alone, SI; of "noise",
        the standard deviation of the cell means and its limit

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
        size = f"{_with_noise(self.size, self.noise)} {unit}"
        when = f"disturbed {self.at - start:.1f} s into the window on {axis}"
        noise = f"where the noise is {self.noise:.1g} {unit}"
        if self.noise > 0:
            noise = f"{abs(self.size) / self.noise:.0f} times the noise"
        says = {
            "push": f"{when}: {self._push(size)}, {noise}",
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

    def _push(self, size: str) -> str:
        """What pushed the output: a force, or a turn of the device."""
        if self.channel < 3:
            return f"a {self.seconds:.1f} s push of {size}"
        return f"a {self.seconds:.1f} s turn at {size}"


def _with_noise(size: float, noise: float) -> str:
    """A departure to the first digit of its standard deviation.

    >>> _with_noise(0.2, 1.2e-4), _with_noise(0.31, 0.02), _with_noise(0.31, 0.0)
    ('+0.2000 ± 0.0001', '+0.31 ± 0.02', '+0.31 ± 0')
    """
    if not noise > 0:
        return f"{size:+.2g} ± 0"
    shown = float(f"{noise:.1g}")
    digits = max(0, -int(np.floor(np.log10(shown))))
    return f"{size:+.{digits}f} ± {shown:.{digits}f}"


@dataclass(frozen=True, slots=True)
class WindowVerdict:
    """Result of the test for rest, for the samples so far.

    Attributes
    ----------
    worst : the largest departure so far
    ratio_now : the largest ratio within the last second
    quiet : noise of the device at rest, for the test of the next window; None as long
        as it is not known

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

    Parameters
    ----------
    cells : of the window so far
    limits : bounds of noise and drift of any device at rest
    before : noise of the device in earlier windows; None if there were none
    visible_steps : (6,) largest jump by rounding alone, SI, if the device states its
        rounding

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
    period = cells.period
    departures = [
        *(_worst_departure(cells.times, period, test, allowed) for test in tests),
        *_stuck_runs(cells),
        _drift_departure(cells, lines, noise, limits),
        _noise_departure(cells, noise.spread[0], limits),
    ]
    recent = [
        test.z[-_LAST_SECOND:].max() for test in tests if test.cells < _LAST_SECOND
    ]
    return WindowVerdict(
        max(departures, key=lambda departure: departure.ratio),
        float(max(recent) / allowed),
        noise,
    )


def _threshold(cells: int) -> float:
    """`THRESHOLD`, raised for a window of more than `THRESHOLD_CELLS` cells.

    The largest of n normal deviates grows as sqrt(2 ln n).
    """
    return float(np.sqrt(THRESHOLD**2 + 2 * np.log(max(1.0, cells / THRESHOLD_CELLS))))


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
    """Standard error (6,) that rounding leaves in a mean of the window, SI."""
    return np.sqrt(variance_of_mean(cells.resolution, np.nan_to_num(cells.noise)))


def _least_spreads(cells: CellTable, always: Array) -> LeastSpread:
    """Lower bounds of the spreads, from `always` (6,), SI, and from how values change.

    The mean square of the changes in a cell, in steps, is taken for the share of
    samples that change by one step, and is limited to 1.
    """
    step, number = cells.resolution, cells.step_counts
    unit = np.where(step > 0, step, np.inf) ** 2
    share = np.minimum(2 * np.nan_to_num(cells.short_lag_variance) / unit, 1.0)
    changed = (share * number).sum(axis=0) / np.maximum(number.sum(axis=0), 1.0)
    return LeastSpread(
        always, largest_deviation(step, changed), _samples_per_cell(cells)
    )


def _samples_per_cell(cells: CellTable) -> Array:
    """Median number of samples in a cell, (6,)."""
    number: Array = np.median(cells.counts, axis=0)
    return number


def _stuck_runs(cells: CellTable) -> list[Departure]:
    """Runs in which a channel repeats one value although it has noise.

    It has noise if its own, or the median of its sensor, exceeds the resolution.
    """
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
    times: Array, period: float, test: DisturbanceStatistic, allowed: float
) -> Departure:
    """Largest departure of one statistic, with the `allowed` ratio z.

    `times` and `period` are those of the cells, s.
    """
    first, channel = divmod(int(np.argmax(test.z)), test.z.shape[1])
    cell = first + test.cells if test.kind == "step" else first
    return Departure(
        float(test.z[first, channel] / allowed),
        test.kind,
        channel,
        float(times[cell]),
        period * test.cells,
        float(test.size[first, channel]),
        float(test.noise[channel]),
    )


def _drift_departure(
    cells: CellTable, lines: Array, noise: QuietNoise, limits: StillnessLimits
) -> Departure:
    """Change of the robust line `lines` (m, 6) over the window, by limit and noise."""
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
    """Standard deviation of the cell means, `scatter` (6,), against its limit."""
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
