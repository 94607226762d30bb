"""Whether the device is still warming up: how fast its temperature changes.

Over the seconds t_i of the last minute with mean temperatures T_i, their straight line
has the slope and the uncertainty

    k = sum (t_i - t)(T_i - T) / S,  S = sum (t_i - t)^2                            (1)
    s^2 = sum r_i^2 / ((n - 2) S) + (q / D)^2                                       (2)

with r_i the residuals, q the smallest step the thermometer makes and D the time they
span: a thermometer of whole degrees shows nothing for a while and then a whole degree.
It is warming up, or cooling down, if |k| - 2 s is above the limit. K, s.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from fieldcal.core.samples import Array, Block

SLOPE_SPAN_S = 60
"""Seconds over which the slope is taken."""

MIN_SLOPE_S = 5
"""Least seconds for a slope."""


class WarmUpWatch:
    """Temperatures as they come, and how fast they change.

    Parameters
    ----------
    limit : K/min that counts as still warming up
    wait : s of device time to wait for it at most, once for a run

    """

    def __init__(self, limit: float, wait: float) -> None:
        self._limit, self._wait = limit, wait
        self._seconds: deque[tuple[float, float]] = deque(maxlen=SLOPE_SPAN_S)
        self._second, self._sum, self._n = -np.inf, 0.0, 0
        self._step = np.inf
        self._last = np.nan
        self._temperature: Array = np.empty(0)
        self._until: float | None = None
        self.waived = False

    def add(self, block: Block) -> None:
        """Take in the block that follows, shorter than a second."""
        known = np.isfinite(block.temperature)
        if not known.any():
            return
        t, temperature = block.t[known], block.temperature[known]
        self._note_step(temperature)
        if self._until is None:
            self._until = float(t[0]) + self._wait
        if np.floor(t[0]) != self._second:
            if self._n:
                self._seconds.append((self._second, self._sum / self._n))
            self._second, self._sum, self._n = float(np.floor(t[0])), 0.0, 0
        self._sum += float(temperature.sum())
        self._n += len(temperature)
        self._last = float(t[-1])

    def forget(self) -> None:
        """Begin anew after the device may have been off."""
        self._seconds.clear()
        self._second, self._sum, self._n = -np.inf, 0.0, 0

    def _note_step(self, temperature: Array) -> None:
        """Note the smallest change between samples, also from block to block."""
        steps = np.abs(np.diff(temperature, prepend=self._temperature))
        self._temperature = temperature[-1:]
        steps = steps[steps > 0]
        if len(steps):
            self._step = min(self._step, float(steps.min()))

    @property
    def rate(self) -> tuple[float, float]:
        """Change in K/min and its standard uncertainty, (1), (2); nan if unknown."""
        if len(self._seconds) < MIN_SLOPE_S:
            return np.nan, np.nan
        t, temperature = np.array(self._seconds).T
        about, s = t - t.mean(), float(((t - t.mean()) ** 2).sum())
        slope = float(about @ temperature) / s  # (1)
        residual = temperature - temperature.mean() - slope * about
        step = self._step if np.isfinite(self._step) else 0.0
        rounding = (step / (t[-1] - t[0])) ** 2
        variance = float(residual @ residual) / (len(t) - 2) / s + rounding  # (2)
        return 60 * slope, 60 * float(np.sqrt(variance))

    @property
    def notice(self) -> str:
        """Notice about the change; empty if the temperature is steady or unknown."""
        rate, sigma = self.rate
        if not abs(rate) - 2 * sigma > self._limit:
            return ""
        word = "warming up" if rate > 0 else "cooling down"
        return (
            f"the device is still {word}: {rate:+.1f} ± {sigma:.1f} K/min, steady is"
            f" less than {self._limit:g} K/min"
        )

    @property
    def must_wait(self) -> bool:
        """Whether a window must wait: the temperature changes, or is not known yet."""
        if self.waived or self._until is None or self._last >= self._until:
            return False
        return len(self._seconds) < MIN_SLOPE_S or bool(self.notice)
