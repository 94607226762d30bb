"""The temperature that the device reports, smoothed, and its rate.

A straight line is fitted to the means over a second within some seconds about each
instant; its value is the temperature. The rate is the slope of a parabola. Both use the
longest span that does not flatten the course of the temperature, so that noise and
rounding of the thermometer are not taken for changes of temperature.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb

import numpy as np

from fieldcal.core.probability import MAD_TO_SIGMA
from fieldcal.core.samples import Array, Block
from fieldcal.model import detections, resolutions, tolerances


@dataclass(frozen=True, slots=True)
class Thermometer:
    """Temperature on a grid of instants.

    Attributes
    ----------
    t : (m,) s, device time
    warming : (m,) K, temperature less that at the start
    heating : (m,) K/s
    start_c : temperature at the start, deg C; nan where there is no thermometer
    noise : standard deviation of the means that were smoothed, K

    """

    t: Array
    warming: Array
    heating: Array
    start_c: float
    noise: float

    @classmethod
    def of(cls, block: Block) -> Thermometer:
        """Smooth the temperature of a recording."""
        known = np.isfinite(block.temperature)
        if known.sum() < detections.MIN_SAMPLES:
            t = np.array([0.0])
            return cls(t, np.array([np.nan]), np.array([np.nan]), np.nan, np.nan)
        t, mean, count = _means(block.t[known], block.temperature[known])
        step = float(np.median(np.diff(t))) if len(t) > 1 else 1.0
        allowed = detections.MAX_VALUE_MISFIT * _scatter(mean, block.temperature[known])
        value, trend, noise = _course(t, mean, count, allowed, step)
        slope = _rate(t, mean, count, noise)
        start = value[0] - trend * (t[0] - block.t[0])
        return cls(t, value - start, slope, float(start), noise)

    @property
    def changes(self) -> bool:
        """Whether the temperature changed by more than the thermometer's own noise."""
        if not np.isfinite(self.start_c):
            return False
        least = max(detections.MIN_WARMING_K, detections.WARMING_SIGMAS * self.noise)
        return bool(np.ptp(self.warming) > least)

    def at(self, t: Array) -> tuple[Array, Array]:
        """Warming and heating at some instants, (n,) each."""
        return np.interp(t, self.t, self.warming), np.interp(t, self.t, self.heating)


def _scatter(mean: Array, values: Array) -> float:
    """Standard deviation of the means about any course: of their noise and the grain.

    >>> noise = np.random.default_rng(1).standard_normal(4000)
    >>> round(_scatter(np.sin(np.arange(4000) / 30) + 0.1 * noise, noise), 2)
    0.1
    """
    bend = np.diff(mean, 2)
    # a thermometer shows most values many times in turn
    shown = values[np.append(True, values[1:] != values[:-1])]
    gaps = np.diff(np.unique(shown))
    grain = float(gaps.min(initial=np.inf)) if len(gaps) else 0.0
    white = float((bend**2).mean()) / 6 if len(bend) else 0.0
    return float(np.sqrt(white + grain**2 / 12))


def _course(
    t: Array, mean: Array, count: Array, allowed: float, step: float
) -> tuple[Array, float, float]:
    """Values over the longest span that flattens nothing; slope at the start; noise."""
    for half in resolutions.VALUE_HALF_SPANS_S:
        value, slope = _line(t, mean, count, max(half, 4 * step))
        noise = float(np.std(mean - value))
        if noise <= allowed:
            return value, float(slope[0]), noise
    return mean, float(slope[0]), allowed / detections.MAX_VALUE_MISFIT


def _rate(t: Array, mean: Array, count: Array, noise: float) -> Array:
    """Slopes over the longest span that flattens nothing.

    The shortest whose slopes are no noise is the measure: longer ones, of less noise,
    are taken while they differ from it by no more than its noise makes.
    """
    step = float(np.median(np.diff(t))) if len(t) > 1 else 1.0
    measure = best = np.zeros_like(t)
    allowed = 0.0
    for half in resolutions.RATE_HALF_SPANS_S:
        half = max(half, 4 * step)
        slope = _slope(t, mean, count, half)
        if allowed == 0.0:
            measure = best = slope
            error = noise * float(np.sqrt(12 * step / (2 * half) ** 3))
            if error < detections.MAX_RATE_NOISE * float(np.std(slope)):
                allowed = detections.MAX_RATE_DIFFERENCE * error
            continue
        if MAD_TO_SIGMA * float(np.median(np.abs(slope - measure))) > allowed:
            break
        best = slope
    return best


def _means(t: Array, values: Array) -> tuple[Array, Array, Array]:
    width = max(
        1.0,
        float(np.minimum(np.diff(t), tolerances.MAX_COUNTED_PAUSE_S).sum())
        / tolerances.MAX_TEMPERATURE_MEANS,
    )
    bins = ((t - t[0]) / width).astype(np.intp)
    first = np.concatenate([[0], np.flatnonzero(np.diff(bins)) + 1])
    count = np.diff(np.append(first, len(t))).astype(float)
    shifted = values - values[0]
    return (
        np.add.reduceat(t, first) / count,
        np.add.reduceat(shifted, first) / count + values[0],
        count,
    )


def _line(t: Array, y: Array, weight: Array, half: float) -> tuple[Array, Array]:
    """Value and slope of local lines, by running sums."""
    middle = t[len(t) // 2]
    s, v = t - middle, y - y[0]
    sums = [
        np.concatenate([[0.0], np.cumsum(weight * term)])
        for term in (np.ones_like(s), s, s * s, v, s * v)
    ]
    low = np.searchsorted(t, t - half, side="left")
    high = np.searchsorted(t, t + half, side="right")
    n, a, b, c, d = (total[high] - total[low] for total in sums)
    spread = b - a * a / n
    slope = np.where(spread > 0, (d - a * c / n) / np.where(spread > 0, spread, 1), 0.0)
    return c / n + slope * (s - a / n) + y[0], slope


def _slope(t: Array, y: Array, weight: Array, half: float) -> Array:
    """Slopes of local parabolas: at an end a line has another's.

    No span reaches over a longer pause; fourth powers of a time on its other side would
    leave nothing of those within a span.
    """
    runs = np.split(np.arange(len(t)), np.flatnonzero(np.diff(t) > half) + 1)
    return np.concatenate([_slope_of_run(t[r], y[r], weight[r], half) for r in runs])


def _slope_of_run(t: Array, y: Array, weight: Array, half: float) -> Array:
    """Slopes of local parabolas in means without a longer pause, by running sums."""
    s = t - t[len(t) // 2]
    powers = s[:, None] ** np.arange(5)
    terms = np.hstack([powers, powers[:, :3] * (y - y[0])[:, None]])
    sums = np.vstack([np.zeros(8), np.cumsum(weight[:, None] * terms, axis=0)])
    low = np.searchsorted(t, t - half, side="left")
    high = np.searchsorted(t, t + half, side="right")
    near = sums[high] - sums[low]
    about = np.zeros((len(t), 5, 5))  # moments about each instant of those about none
    for k in range(5):
        for j in range(k + 1):
            about[:, k, j] = comb(k, j) * (-s) ** (k - j)
    moments = (about @ near[:, :5, None])[..., 0]
    right = about[:, :3, :3] @ near[:, 5:, None]
    scale = half ** np.add.outer(np.arange(3), np.arange(3))
    left = moments[:, np.add.outer(np.arange(3), np.arange(3))] / scale
    left += tolerances.SINGULAR * left[:, :1, :1] * np.eye(3)
    coefficients = np.linalg.solve(left, right / half ** np.arange(3)[:, None])
    return coefficients[:, 1, 0] / half
